// SPDX-License-Identifier: MIT OR Apache-2.0
//! Prefix sums against the CPU.

use crate::harness::{Random, gpu, read, storage, submit};
use lucerna::components::voxels::Scan;

fn scanned(numbers: &[u32], n: u32) -> Vec<u32> {
    let gpu = gpu();
    let buffer = storage(bytemuck::cast_slice(numbers));
    let scan = Scan::new(gpu);
    let plan = scan.plan(gpu, &buffer, n).unwrap();
    submit(|recorder| scan.record(&mut recorder.compute("scan"), &plan));
    bytemuck::cast_slice(&read(&buffer)[..4 * numbers.len()]).to_vec()
}

/// Fails with the first sum that differs.
fn assert_scanned(numbers: &[u32], n: u32, expected: &[u32]) {
    let found = scanned(numbers, n);
    let differ = |ix: &usize| found[*ix] != expected[*ix];
    if let Some(ix) = (0..expected.len()).find(differ) {
        let n_differ = (0..expected.len()).filter(differ).count();
        panic!(
            "sums of {n} numbers: {n_differ} of {} are wrong, the first is sum {ix}: {}, expected {}",
            expected.len(),
            found[ix],
            expected[ix]
        );
    }
}

/// All lengths around those of runs, workgroups, blocks and levels; numbers after the end stay.
#[test]
fn scan_equals_the_cpu() {
    let mut random = Random(1);
    for n in [
        0, 1, 2, 3, 4, 5, 63, 255, 256, 257, 1023, 1024, 1025, 4095, 4096, 4097, 100_003,
        1_048_575, 1_048_576, 1_048_577, 3_000_001,
    ] {
        let numbers: Vec<u32> = (0..n + 5).map(|_| (random.bits() % 1000) as u32).collect();
        let mut expected = numbers.clone();
        let mut sum = 0u32;
        for number in &mut expected[..n] {
            (sum, *number) = (sum + *number, sum);
        }
        assert_scanned(&numbers, n as u32, &expected);
    }
}

/// 2²⁴ + 1 numbers: three levels.
#[test]
fn scan_of_sixteen_million() {
    let n = (1usize << 24) + 1;
    let numbers: Vec<u32> =
        (0..n as u32).map(|k| (k.wrapping_mul(2_654_435_761) >> 25) & 1).collect();
    let mut expected = numbers.clone();
    let mut sum = 0;
    for number in &mut expected {
        (sum, *number) = (sum + *number, sum);
    }
    assert_scanned(&numbers, n as u32, &expected);
}

/// Sums that would pass 2³² stay at 2³² − 1.
#[test]
fn scan_saturates() {
    let numbers: Vec<u32> = (0..5000).map(|k| if k % 700 == 3 { 0x4000_0000 } else { k }).collect();
    let mut expected = numbers.clone();
    let mut sum = 0u32;
    for number in &mut expected {
        (sum, *number) = (sum.saturating_add(*number), sum);
    }
    assert_eq!(*expected.last().unwrap(), u32::MAX, "the last sum on the CPU saturates");
    assert_scanned(&numbers, 5000, &expected);
}
