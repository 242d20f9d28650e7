// SPDX-License-Identifier: MIT OR Apache-2.0
//! How much light is on its way, against sums and series in f64.

use crate::harness::{Random, gpu, storage, submit, uniform};
use lucerna::blocking::read_stat;
use lucerna::components::convergence::{Convergence, UNKNOWN};

/// Values of each part that there is room for: less than a block, a whole one, and two and a bit.
const CAPACITIES: [u32; 3] = [100, 8192, 20_000];
/// How many there are.
const COUNTS: [u32; 3] = [100, 8000, 16_385];

/// Values after so many frames: `lights[k]` of part k, times a number of each value's own.
fn values(lights: [f64; 3]) -> Vec<[f32; 4]> {
    let mut random = Random(3);
    let mut out = Vec::new();
    for ((capacity, count), light) in CAPACITIES.into_iter().zip(COUNTS).zip(lights) {
        for ix in 0..capacity {
            let own: [f32; 4] = std::array::from_fn(|_| random.unit());
            let sign = if ix % 3 == 0 { -1.0 } else { 1.0 };
            // (What is beyond the count is no value.)
            let light = if ix < count { light as f32 } else { 1e9 };
            out.push([light * own[0], light * own[1], light * own[2], sign * own[3]]);
        }
    }
    out
}

struct Rig {
    convergence: Convergence,
    counts: Vec<wgpu::Buffer>,
}

impl Rig {
    fn new() -> Self {
        let counts = COUNTS.map(|n| uniform(bytemuck::cast_slice(&[7u32, 9, n, 11])));
        Self { convergence: Convergence::new(gpu(), CAPACITIES).unwrap(), counts: counts.into() }
    }

    /// Shows it a frame's values; returns the light to come and the change since half as many frames [ppm].
    fn show(&mut self, values: &[[f32; 4]]) -> [u64; 2] {
        let light = storage(bytemuck::cast_slice(values));
        submit(|recorder| self.convergence.record(recorder, &light, &self.counts));
        let Self { convergence, .. } = self;
        [convergence.to_come(), convergence.since_half()].map(|s| read_stat(gpu(), &s).unwrap())
    }
}

/// Σ over values of |a|·(r + g + b).
fn sum(values: &[[f32; 4]]) -> f64 {
    values.iter().map(|v| v.map(f64::from)).map(|[r, g, b, a]| a.abs() * (r + g + b)).sum()
}

/// Per block of 8192 values of each part: the sums of its runs of 128 values that are even and odd.
fn block_sums(values: &[[f32; 4]]) -> Vec<[f64; 2]> {
    let mut first = 0;
    let mut out = Vec::new();
    for (capacity, count) in CAPACITIES.into_iter().zip(COUNTS) {
        let part = &values[first..first + count as usize];
        out.extend(
            part.chunks(8192).map(|block| {
                [0, 1].map(|odd| block.chunks(128).skip(odd).step_by(2).map(sum).sum())
            }),
        );
        first += capacity as usize;
    }
    out
}

/// √(S + 2σ) over blocks: S = Σ Δa·Δb, σ² = Σ (Δa·Δb)².
fn apart(a: &[[f64; 2]], b: &[[f64; 2]]) -> f64 {
    let products: Vec<_> = a.iter().zip(b).map(|(a, b)| (a[0] - b[0]) * (a[1] - b[1])).collect();
    let variance: f64 = products.iter().map(|product| product * product).sum();
    (products.iter().sum::<f64>() + 2.0 * variance.sqrt()).sqrt()
}

/// √(Σ a·b) over blocks.
fn size(a: &[[f64; 2]]) -> f64 {
    a.iter().map(|[a, b]| a * b).sum::<f64>().sqrt()
}

/// Light that misses a part c/n² after n frames, in one part of the scene more than in another: exactly what is missing is on
/// its way. Every time is compared with those of half and a quarter of its frames.
#[test]
fn a_power_law_is_told_what_it_lacks() {
    let light = |n: u32, lacks: f64| 1.0 - lacks / f64::from(n * n);
    let at = |n| values([light(n, 0.2), light(n, 0.9), light(n, 0.0)]);
    let mut rig = Rig::new();
    let mut n_told = 0;
    for n in 1..=49u32 {
        let [to_come, since_half] = rig.show(&at(n));
        let is_compared = [8, 12, 16, 24, 32, 48].contains(&n);
        if n < 8 {
            assert_eq!([to_come, since_half], [u64::from(UNKNOWN); 2], "after {n} frames");
        }
        if !is_compared {
            continue;
        }
        n_told += 1;
        let [now, half, end] = [at(n), at(n / 2), values([1.0; 3])].map(|of| block_sums(&of));
        let total = size(&now);
        // The sums are those of 128 numbers a lane and 64 lanes in f32: relative 1e-6 of the light, and so 1 ppm, twice; the
        // estimate multiplies differences of a few hundred ppm by r/(1 − r), r = 1/4 within a few per cent.
        for (what, found, expected) in [
            ("to come", to_come, 1e6 * apart(&end, &now) / total),
            ("since half", since_half, 1e6 * apart(&now, &half) / total),
        ] {
            let limit = 3.0 + 0.01 * expected;
            assert!(
                (found as f64 - expected).abs() <= limit,
                "{what} after {n} frames: {found} ppm, expected {expected:.1} within {limit:.1}"
            );
        }
    }
    assert_eq!(n_told, 6, "times at which it was told");
}

/// Light that grows by the same amount with each doubling has no end; it is told as three times the last change.
#[test]
fn light_that_does_not_converge_is_told() {
    let mut rig = Rig::new();
    let mut told = [0; 2];
    for n in 1..=16u32 {
        told = rig.show(&values([10.0 + f64::from(n).log2(); 3]));
    }
    let [to_come, since_half] = told.map(|ppm| ppm as f64);
    let [now, half] = [14.0, 13.0].map(|light| block_sums(&values([light; 3])));
    let expected = 1e6 * apart(&now, &half) / size(&now);
    assert!(
        (since_half - expected).abs() < 5.0,
        "since half: {since_half}, expected {expected:.1}"
    );
    assert!(
        (to_come - 3.0 * since_half).abs() < 20.0,
        "to come: {to_come}, expected three times that"
    );
}

/// No light is settled; light that is gone is not; after a restart nothing is known; values of no number do not count.
#[test]
fn without_light_and_after_a_restart() {
    let mut rig = Rig::new();
    let dark = values([0.0; 3]);
    let lit = values([1.0; 3]);
    for n in 1..=8 {
        let [to_come, _] = rig.show(&dark);
        let expected = if n < 8 { UNKNOWN.into() } else { 0 };
        assert_eq!(to_come, expected, "light to come after {n} dark frames [ppm]");
    }
    submit(|recorder| rig.convergence.restart(recorder));
    assert_eq!(read_stat(gpu(), &rig.convergence.to_come()).unwrap(), u64::from(UNKNOWN));
    for _ in 1..=7 {
        rig.show(&lit);
    }
    let [to_come, since_half] = rig.show(&dark);
    assert!(
        since_half > 1_000_000_000 && to_come > 1_000_000_000,
        "light that is gone: {to_come} to come, changed by {since_half} ppm"
    );
    let mut rig = Rig::new();
    let mut broken = lit.clone();
    let mut without = lit.clone();
    for ix in (0..20_000).step_by(37) {
        broken[ix] = [1.0, [f32::NAN, f32::INFINITY][ix % 2], 1.0, 1.0];
        without[ix] = [0.0; 4];
    }
    for _ in 1..=7 {
        rig.show(&lit);
    }
    let [_, since_half] = rig.show(&broken);
    let [whole, left] = [&lit, &without].map(|values| block_sums(values));
    let lost = 1e6 * apart(&whole, &left) / size(&left);
    assert!(
        (since_half as f64 - lost).abs() < 5.0,
        "values of no number: changed by {since_half} ppm, expected {lost:.1}"
    );
}

/// Noise that differs from frame to frame and from value to value is no light on its way.
#[test]
fn noise_is_not_on_its_way() {
    let mut rig = Rig::new();
    let mut random = Random(11);
    let mut told = [0; 2];
    for _ in 1..=16 {
        let mut noisy = values([1.0; 3]);
        noisy.iter_mut().for_each(|value| value[3] *= 2.0 * random.unit());
        told = rig.show(&noisy);
    }
    // A half block of 4096 values, each with a noise of 0.7, has one of 1 %, a change 1.5 %. Of 4 whole blocks' products S has a noise
    // of 2σ / 4, so that √(S + 2σ) is 1.5 % or so; without the noise, it would be 0.
    assert!(told[1] < 20_000, "noise is told as a change of {} ppm", told[1]);
}

/// Too few values for two halves are never said to have settled.
#[test]
fn too_few_values_are_not_known() {
    let mut convergence = Convergence::new(gpu(), [50]).unwrap();
    let counts = [uniform(bytemuck::cast_slice(&[0u32, 0, 50, 0]))];
    let light = storage(bytemuck::cast_slice(&[[1.0f32; 4]; 50]));
    for _ in 1..=8 {
        submit(|recorder| convergence.record(recorder, &light, &counts));
    }
    let told = read_stat(gpu(), &convergence.to_come()).unwrap();
    assert!(told > 1_000_000_000, "50 values that do not change: {told} ppm are on their way");
}

/// What is told does not depend on the unit of the light.
#[test]
fn shares_have_no_unit() {
    let told = [1e-15, 1.0, 1e15].map(|unit| {
        let mut rig = Rig::new();
        let mut told = [0; 2];
        for n in 1..=8u32 {
            told = rig.show(&values([unit * (1.0 - 1.0 / f64::from(1 + n * n)); 3]));
        }
        told
    });
    for other in [told[0], told[2]] {
        for (other, expected) in other.into_iter().zip(told[1]) {
            assert!(expected > 1000 && other.abs_diff(expected) <= 2, "{told:?}");
        }
    }
}

/// Whatever the values, the same bytes.
#[test]
fn the_same_values_give_the_same_bytes() {
    let run = || {
        let mut rig = Rig::new();
        (1..=12).map(|n| rig.show(&values([f64::from(n).sqrt(); 3]))).collect::<Vec<_>>()
    };
    assert_eq!(run(), run());
}
