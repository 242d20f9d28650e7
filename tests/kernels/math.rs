//! `wgsl/math`.

use crate::harness::{Random, map};
use glam::{DVec3, Vec3, Vec4};

/// Directions along and near the axes, diagonals, and random ones.
pub fn directions(n: usize, seed: u64) -> Vec<Vec3> {
    let mut out = Vec::new();
    for x in [-1.0, -1e-4, -0.0, 0.0, 1e-4, 1.0] {
        for y in [-1.0, -1e-7, 0.0, 1e-7, 1.0] {
            for z in [-1.0, -1e-7, -0.0, 0.0, 1e-7, 1.0] {
                let v = DVec3::new(x, y, z);
                if v.length() > 0.5 {
                    out.push(v.normalize().as_vec3());
                }
            }
        }
    }
    let mut random = Random(seed);
    out.extend(std::iter::repeat_with(|| random.direction()).take(n));
    out
}

/// Columns are orthonormal and right-handed. Tolerance: the paper states 3.5e-7 worst error of an
/// entry in f32 for any normal; a unit normal rounded to f32 adds 2 roundings (1.2e-7).
#[test]
fn frame_is_orthonormal_everywhere() {
    let inputs: Vec<Vec4> = directions(20_000, 1).iter().map(|n| n.extend(0.0)).collect();
    let outputs: Vec<[Vec4; 3]> = map(
        "#import lucerna::math::frame::frame_from_normal
        struct Output { x: vec4<f32>, y: vec4<f32>, z: vec4<f32> }
        alias Input = vec4<f32>;
        fn map(input: Input) -> Output {
            let m = frame_from_normal(input.xyz);
            return Output(vec4<f32>(m[0], 0.0), vec4<f32>(m[1], 0.0), vec4<f32>(m[2], 0.0));
        }",
        &inputs,
    );
    for (input, columns) in inputs.iter().zip(&outputs) {
        let [x, y, z] = columns.map(|c| c.truncate().as_dvec3());
        assert_eq!(z.as_vec3(), input.truncate());
        let errors = [
            x.dot(y).abs(),
            x.dot(z).abs(),
            y.dot(z).abs(),
            (x.length() - 1.0).abs(),
            (y.length() - 1.0).abs(),
            (x.cross(y) - z).length(),
        ];
        let worst = errors.into_iter().fold(0.0, f64::max);
        assert!(worst < 5e-7, "normal {input}: error {worst:e}, columns {columns:?}");
    }
}
