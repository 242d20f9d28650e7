// SPDX-License-Identifier: MIT OR Apache-2.0
//! What components and techniques say of themselves: numbers and sentences.

/// A number about a technique.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Stat {
    /// What is counted.
    pub name: &'static str,
    /// Of what: `bytes`, `faces`, …
    pub unit: &'static str,
    /// Where the number stands.
    pub source: StatSource,
    /// Of what should be 0: what to do where it is more, for then light is missing or wrong.
    pub fault: Option<&'static str>,
}

/// Where a [`Stat`] stands.
#[derive(Clone, Debug)]
pub enum StatSource {
    /// The CPU knows it.
    Known(u64),
    /// A u32 at this byte of a buffer with `COPY_SRC`.
    Buffer(wgpu::Buffer, u64),
}

impl Stat {
    /// What the CPU knows.
    pub fn known(name: &'static str, unit: &'static str, number: u64) -> Self {
        Self { name, unit, source: StatSource::Known(number), fault: None }
    }

    /// A u32 at this byte of a buffer with `COPY_SRC`.
    pub fn counted(name: &'static str, unit: &'static str, buffer: &wgpu::Buffer, at: u64) -> Self {
        Self { name, unit, source: StatSource::Buffer(buffer.clone(), at), fault: None }
    }

    /// The same as something that should be 0, with what to do where it is more.
    pub fn fault(mut self, advice: &'static str) -> Self {
        self.fault = Some(advice);
        self
    }
}

/// Something about a technique and a scene, in a sentence.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct Notice {
    /// Light will be missing or wrong.
    pub is_warning: bool,
    /// The sentence, without a full stop.
    pub text: String,
}

impl Notice {
    /// What is good to know.
    pub fn note(text: String) -> Self {
        Self { is_warning: false, text }
    }

    /// What will be wrong, and what to do about it.
    pub fn warning(text: String) -> Self {
        Self { is_warning: true, text }
    }
}
