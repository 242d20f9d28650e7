// SPDX-License-Identifier: MIT OR Apache-2.0
//! Checked reading of accessors: every offset is checked against its buffer before it is used.

use std::borrow::Cow;

use gltf::json::accessor::{Accessor, ComponentType, Type};
use gltf::json::validation::Checked;
use gltf::json::{Index, Root, accessor, buffer};

use super::index;
use crate::scene::error::{DataProblem, ErrorKind, Warning, Warnings};
use crate::scene::limits::Budget;

/// The data that accessors read.
pub(super) struct Data<'a> {
    pub root: &'a Root,
    /// One per glTF buffer, `byteLength` bytes each.
    pub buffers: Vec<Cow<'a, [u8]>>,
}

/// Elements one after another, with sparse values inserted.
struct Packed {
    bytes: Vec<u8>,
    component: ComponentType,
    normalized: bool,
}

const FLOAT: &[ComponentType] = &[ComponentType::F32];
const FLOAT_OR_UNORM: &[ComponentType] =
    &[ComponentType::F32, ComponentType::U8, ComponentType::U16];
const UNSIGNED: &[ComponentType] = &[ComponentType::U8, ComponentType::U16, ComponentType::U32];

impl Data<'_> {
    /// Vectors of 32-bit floats, or 4 × 4 matrices by columns, as stored, including NaN and infinity.
    pub fn floats<const N: usize>(
        &self,
        ix: Index<Accessor>,
        at: &str,
        budget: &mut Budget,
        warnings: &mut Warnings,
    ) -> Result<Vec<[f32; N]>, ErrorKind> {
        let packed = self.packed(
            ix,
            at,
            N,
            FLOAT,
            if N == 16 { "MAT4 of FLOAT" } else { "a vector of FLOAT" },
            budget,
            warnings,
        )?;
        let floats = to_floats(&packed);
        budget.give_back(packed.bytes.len() as u64);
        Ok(floats)
    }

    /// Vectors of floats, or of normalized unsigned bytes or shorts (0..=1).
    pub fn unorms<const N: usize>(
        &self,
        ix: Index<Accessor>,
        at: &str,
        budget: &mut Budget,
        warnings: &mut Warnings,
    ) -> Result<Vec<[f32; N]>, ErrorKind> {
        const EXPECTED: &str =
            "a vector of FLOAT, or of normalized UNSIGNED_BYTE or UNSIGNED_SHORT";
        let packed = self.packed(ix, at, N, FLOAT_OR_UNORM, EXPECTED, budget, warnings)?;
        if packed.component != ComponentType::F32 && !packed.normalized {
            return Err(problem(
                at,
                ix,
                DataProblem::Type {
                    found: format!("not normalized {:?}", packed.component),
                    expected: EXPECTED,
                },
            ));
        }
        let floats = to_floats(&packed);
        budget.give_back(packed.bytes.len() as u64);
        Ok(floats)
    }

    /// Vertex indices.
    pub fn indices(
        &self,
        ix: Index<Accessor>,
        at: &str,
        budget: &mut Budget,
        warnings: &mut Warnings,
    ) -> Result<Vec<u32>, ErrorKind> {
        const EXPECTED: &str = "a SCALAR of an unsigned type";
        let packed = self.packed(ix, at, 1, UNSIGNED, EXPECTED, budget, warnings)?;
        let indices = to_indices(&packed.bytes, packed.component);
        budget.give_back(packed.bytes.len() as u64);
        Ok(indices)
    }

    /// Indices of four joints per vertex.
    pub fn joints(
        &self,
        ix: Index<Accessor>,
        at: &str,
        budget: &mut Budget,
        warnings: &mut Warnings,
    ) -> Result<Vec<[u32; 4]>, ErrorKind> {
        const EXPECTED: &str = "a VEC4 of UNSIGNED_BYTE or UNSIGNED_SHORT";
        const COMPONENTS: &[ComponentType] = &[ComponentType::U8, ComponentType::U16];
        let packed = self.packed(ix, at, 4, COMPONENTS, EXPECTED, budget, warnings)?;
        let flat = to_indices(&packed.bytes, packed.component);
        let joints = flat.chunks_exact(4).map(|j| [j[0], j[1], j[2], j[3]]).collect();
        budget.give_back(packed.bytes.len() as u64);
        Ok(joints)
    }

    /// Number of components of an element.
    pub fn n_components(&self, ix: Index<Accessor>, at: &str) -> Result<usize, ErrorKind> {
        let accessor = index(&self.root.accessors, ix.value(), "accessors", || at.to_owned())?;
        match accessor.type_ {
            Checked::Valid(kind) => Ok(kind.multiplicity()),
            Checked::Invalid => Err(problem(at, ix, DataProblem::Unknown("type"))),
        }
    }

    #[expect(clippy::too_many_arguments, reason = "each is a different check")]
    fn packed(
        &self,
        ix: Index<Accessor>,
        at: &str,
        n_components: usize,
        components: &[ComponentType],
        expected: &'static str,
        budget: &mut Budget,
        warnings: &mut Warnings,
    ) -> Result<Packed, ErrorKind> {
        let wrong = |p| problem(at, ix, p);
        let accessor = index(&self.root.accessors, ix.value(), "accessors", || at.to_owned())?;
        let Checked::Valid(accessor::GenericComponentType(component)) = accessor.component_type
        else {
            return Err(wrong(DataProblem::Unknown("componentType")));
        };
        let Checked::Valid(kind) = accessor.type_ else {
            return Err(wrong(DataProblem::Unknown("type")));
        };
        // The only matrices read are those of 4 × 4 floats, whose columns are never padded.
        let is_known = match kind {
            Type::Scalar | Type::Vec2 | Type::Vec3 | Type::Vec4 => true,
            Type::Mat4 => component == ComponentType::F32,
            Type::Mat2 | Type::Mat3 => false,
        };
        if !is_known || kind.multiplicity() != n_components || !components.contains(&component) {
            return Err(wrong(DataProblem::Type {
                found: format!("{kind:?} of {component:?}"),
                expected,
            }));
        }
        let size = component.size() * n_components;
        let count = accessor.count.0;
        // Vertex indices are 32-bit. The result has 4 bytes per component, and exists at the same time as the bytes
        // packed here.
        let n = usize::try_from(count).ok().filter(|&n| u32::try_from(n).is_ok());
        budget.take(count, (4 * n_components + size) as u64, at)?;
        let n = n.ok_or_else(|| ErrorKind::TooMuch {
            what: at.to_owned(),
            needed: count,
            limit: u64::from(u32::MAX),
            setting: "max_bytes",
        })?;

        let mut bytes = Vec::new();
        if let Some(view) = accessor.buffer_view {
            let offset = accessor.byte_offset.map_or(0, |o| o.0);
            let source = self.strided(view, offset, count, size, component.size(), &wrong)?;
            if source.misaligned {
                warnings
                    .push(Warning::Misaligned { at: format!("accessors[{}] ({at})", ix.value()) });
            }
            bytes.reserve_exact(n * size);
            if n > 0 && source.stride == size {
                bytes.extend_from_slice(&source.bytes[..n * size]);
            } else {
                for i in 0..n {
                    let start = i * source.stride;
                    bytes.extend_from_slice(&source.bytes[start..start + size]);
                }
            }
        } else {
            // glTF 2.0 §5.1.1: without a buffer view, zeros (which sparse values may replace).
            bytes.resize(n * size, 0);
        }
        if let Some(sparse) = &accessor.sparse {
            self.put_sparse(sparse, &mut bytes, size, component.size(), count, &wrong)?;
        }
        Ok(Packed { bytes, component, normalized: accessor.normalized })
    }

    fn put_sparse(
        &self,
        sparse: &accessor::sparse::Sparse,
        bytes: &mut [u8],
        size: usize,
        component_size: usize,
        count: u64,
        wrong: &impl Fn(DataProblem) -> ErrorKind,
    ) -> Result<(), ErrorKind> {
        let Checked::Valid(accessor::IndexComponentType(component)) = sparse.indices.component_type
        else {
            return Err(wrong(DataProblem::Unknown("sparse.indices.componentType")));
        };
        let n = sparse.count.0;
        let at = sparse.indices.byte_offset.0;
        let indices = self.strided(
            sparse.indices.buffer_view,
            at,
            n,
            component.size(),
            component.size(),
            wrong,
        )?;
        let at = sparse.values.byte_offset.0;
        let values = self.strided(sparse.values.buffer_view, at, n, size, component_size, wrong)?;
        // Both are within buffers, so `n` fits a usize.
        let mut least = 0u64;
        for number in 0..n as usize {
            let start = number * indices.stride;
            let index = match indices.bytes[start..start + component.size()] {
                [a] => u64::from(a),
                [a, b] => u64::from(u16::from_le_bytes([a, b])),
                [a, b, c, d] => u64::from(u32::from_le_bytes([a, b, c, d])),
                _ => return Err(wrong(DataProblem::Unknown("sparse.indices.componentType"))),
            };
            if index < least || index >= count {
                return Err(wrong(DataProblem::Sparse { number, index, count }));
            }
            least = index + 1;
            let to = index as usize * size;
            let from = number * values.stride;
            bytes[to..to + size].copy_from_slice(&values.bytes[from..from + size]);
        }
        Ok(())
    }

    /// `count` elements of `size` bytes from `offset` in a view, checked to be within it.
    fn strided(
        &self,
        view_ix: Index<buffer::View>,
        offset: u64,
        count: u64,
        size: usize,
        alignment: usize,
        wrong: &impl Fn(DataProblem) -> ErrorKind,
    ) -> Result<Strided<'_>, ErrorKind> {
        let (bytes, start_in_buffer, stride) = self.view(view_ix)?;
        let stride = stride.unwrap_or(size);
        if stride < size {
            return Err(wrong(DataProblem::Stride { stride, size }));
        }
        let len = bytes.len() as u64;
        let end = match count.checked_sub(1) {
            None => Some(offset),
            Some(last) => last
                .checked_mul(stride as u64)
                .and_then(|n| n.checked_add(size as u64))
                .and_then(|n| n.checked_add(offset)),
        };
        let inside = end.filter(|&end| end <= len).ok_or_else(|| {
            wrong(DataProblem::Outside {
                start: offset,
                end: end.unwrap_or(u64::MAX),
                of: format!("bufferViews[{}]", view_ix.value()),
                len,
            })
        })?;
        let alignment = alignment as u64;
        let aligned = (start_in_buffer + offset).is_multiple_of(alignment)
            && (stride as u64).is_multiple_of(alignment);
        Ok(Strided {
            bytes: &bytes[offset as usize..inside as usize],
            stride,
            misaligned: !aligned,
        })
    }

    /// A view's bytes, where they start in the buffer, and its stride.
    pub fn view(&self, ix: Index<buffer::View>) -> Result<(&[u8], u64, Option<usize>), ErrorKind> {
        let at = || format!("bufferViews[{}]", ix.value());
        let view =
            index(&self.root.buffer_views, ix.value(), "bufferViews", || "bufferView".to_owned())?;
        let buffer_ix = view.buffer.value();
        let buffer = index(&self.buffers, buffer_ix, "buffers", || format!("{}.buffer", at()))?;
        let start = view.byte_offset.map_or(0, |o| o.0);
        let end = start.checked_add(view.byte_length.0);
        let bytes = end
            .and_then(|end| buffer.get(usize::try_from(start).ok()?..usize::try_from(end).ok()?))
            .ok_or_else(|| ErrorKind::Data {
                at: at(),
                problem: DataProblem::Outside {
                    start,
                    end: end.unwrap_or(u64::MAX),
                    of: format!("buffers[{buffer_ix}]"),
                    len: buffer.len() as u64,
                },
            })?;
        Ok((bytes, start, view.byte_stride.map(|s| s.0)))
    }
}

struct Strided<'a> {
    bytes: &'a [u8],
    stride: usize,
    misaligned: bool,
}

fn problem(at: &str, ix: Index<Accessor>, problem: DataProblem) -> ErrorKind {
    ErrorKind::Data { at: format!("{at}: accessors[{}]", ix.value()), problem }
}

fn to_floats<const N: usize>(packed: &Packed) -> Vec<[f32; N]> {
    let vectors = |size: usize, read: &dyn Fn(&[u8]) -> f32| -> Vec<[f32; N]> {
        packed
            .bytes
            .chunks_exact(size * N)
            .map(|element| std::array::from_fn(|i| read(&element[i * size..(i + 1) * size])))
            .collect()
    };
    match packed.component {
        ComponentType::F32 => vectors(4, &|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]])),
        ComponentType::U8 => vectors(1, &|b| f32::from(b[0]) / 255.0),
        ComponentType::U16 => {
            vectors(2, &|b| f32::from(u16::from_le_bytes([b[0], b[1]])) / 65535.0)
        }
        // `packed` lets no others through.
        ComponentType::I8 | ComponentType::I16 | ComponentType::U32 => Vec::new(),
    }
}

fn to_indices(bytes: &[u8], component: ComponentType) -> Vec<u32> {
    match component {
        ComponentType::U8 => bytes.iter().map(|&b| u32::from(b)).collect(),
        ComponentType::U16 => {
            bytes.chunks_exact(2).map(|b| u32::from(u16::from_le_bytes([b[0], b[1]]))).collect()
        }
        ComponentType::U32 => {
            bytes.chunks_exact(4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect()
        }
        // `packed` lets no others through.
        ComponentType::I8 | ComponentType::I16 | ComponentType::F32 => Vec::new(),
    }
}
