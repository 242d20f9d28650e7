// SPDX-License-Identifier: MIT OR Apache-2.0
//! Comparison numbers against scikit-image, numpy and NVIDIA's FLIP, and against closed forms.

use glam::Vec3;
use lucerna::compare::{CompareError, Comparison, Side, compare, difference_picture};
use lucerna::picture::{Picture, PictureError, PngOptions};

use crate::support::{Random, empty_folder, fixture, picture};

fn pair(test: &str, reference: &str) -> (Picture, Picture) {
    (Picture::read(fixture(test)).unwrap(), Picture::read(fixture(reference)).unwrap())
}

/// Checks every field, and fails once for all that are off.
fn assert_near(got: &Comparison, want: &Comparison, tolerance: f64, flip_tolerance: f64) {
    let mut off = Vec::new();
    let mut check = |name: &str, got: f64, want: f64, tolerance: f64| {
        // Infinities are equal or not.
        let off_by = (got - want).abs();
        if got != want && (off_by.is_nan() || off_by > tolerance) {
            off.push(format!(
                "{name}: got {got:.12}, want {want:.12}, off by {:e} of {tolerance:e}",
                got - want
            ));
        }
    };
    for c in 0..3 {
        check("mean_test", got.mean_test[c], want.mean_test[c], tolerance);
        check("mean_reference", got.mean_reference[c], want.mean_reference[c], tolerance);
        check("mean_ratio", got.mean_ratio[c], want.mean_ratio[c], tolerance);
    }
    check("mse", got.mse, want.mse, tolerance);
    check("rmse", got.rmse, want.rmse, tolerance);
    check("relative_rmse", got.relative_rmse, want.relative_rmse, tolerance);
    // 10·log₁₀: a relative error ε of the mean square is 4.35 ε.
    check("psnr_db", got.psnr_db, want.psnr_db, 10.0 * tolerance);
    check("ssim", got.ssim.unwrap_or(f64::NAN), want.ssim.unwrap_or(f64::NAN), tolerance);
    // 0..100.
    check(
        "mean_lightness_error",
        got.mean_lightness_error,
        want.mean_lightness_error,
        100.0 * tolerance,
    );
    check("mean_flip", got.mean_flip, want.mean_flip, flip_tolerance);
    assert!(off.is_empty(), "\n{}", off.join("\n"));
    assert_eq!((got.width, got.height), (want.width, want.height));
}

// The numbers of both golden tests: scikit-image 0.26.0 (structural_similarity, peak_signal_noise_ratio), numpy
// 2.4.6 in f64, flip-evaluator 1.7 (NVIDIA's own, LDR, 67 pixels per degree) on the display values rounded to bytes.
// fixtures/compare/README.md says where the pictures come from.

#[test]
fn noise_in_exr_as_scikit_image_has_it() {
    let (test, reference) = pair("cornell_96_noisy.exr", "cornell_96.exr");
    let want = Comparison {
        width: 96,
        height: 96,
        mean_test: [1.042_280_933_095_349_3, 0.718_651_543_888_780_8, 0.332_949_222_789_870_2],
        mean_reference: [1.043_612_407_313_452_7, 0.714_493_251_509_136_7, 0.334_934_677_514_765],
        mean_ratio: [0.998_724_167_891_477_1, 1.005_819_918_341_931_4, 0.994_072_113_584_574_5],
        mse: 0.443_799_746_618_872_67,
        rmse: 0.666_182_967_824_060_1,
        relative_rmse: 0.954_854_461_605_586_4,
        psnr_db: 21.487_251_516_060_365,
        ssim: Some(0.550_390_136_654_28),
        mean_lightness_error: 2.838_977_957_635_618_7,
        mean_flip: 0.121_095_864_549_159_97,
    };
    // Halves are exact in f32 and f64, so both sides differ by f64 rounding alone. FLIP: f32, and fused or not.
    assert_near(&compare(&test, &reference).unwrap(), &want, 1e-9, 1e-5);
}

#[test]
fn missing_light_in_png_as_scikit_image_has_it() {
    let (test, reference) = pair("cornell_96x72_direct.png", "cornell_96x72.png");
    let want = Comparison {
        width: 96,
        height: 72,
        mean_test: [0.057_539_353_999_905_31, 0.034_524_734_010_465_92, 0.015_895_220_775_704_863],
        mean_reference: [
            0.227_929_457_552_072_92,
            0.086_392_178_406_251_67,
            0.035_203_716_702_368_42,
        ],
        mean_ratio: [0.252_443_692_964_784_2, 0.399_628_006_231_262_93, 0.451_521_096_766_338_6],
        mse: 0.013_158_514_629_477_291,
        rmse: 0.114_710_568_952_809_62,
        relative_rmse: 0.984_568_656_433_055_6,
        psnr_db: 13.148_930_948_904_207,
        ssim: Some(0.461_360_208_485_099_04),
        mean_lightness_error: 21.764_872_171_883_393,
        mean_flip: 0.654_354_612_877_661_4,
    };
    // A picture stores linear values in f32: 2⁻²⁴ = 6e-8 relative each, at worst all of one sign.
    assert_near(&compare(&test, &reference).unwrap(), &want, 1e-6, 1e-5);
}

#[test]
fn identical_pictures() {
    let mut random = Random(1);
    let p = picture(33, 17, |_, _| {
        Vec3::from(std::array::from_fn(|_| (4.0 * random.unit() - 1.0) as f32))
    });
    let c = compare(&p, &p).unwrap();
    assert_eq!((c.mse, c.rmse, c.relative_rmse), (0.0, 0.0, 0.0));
    assert_eq!(c.mean_ratio, [1.0; 3]);
    assert_eq!(c.psnr_db, f64::INFINITY);
    // Numerator and denominator differ by the rounding of a few sums.
    assert!((c.ssim.unwrap() - 1.0).abs() < 1e-12, "{:?}", c.ssim);
    assert_eq!((c.mean_lightness_error, c.mean_flip), (0.0, 0.0));
    let json = c.to_json();
    assert!(json["psnr_db"].is_null());
    assert_eq!(json["mean_ratio"], serde_json::json!([1.0, 1.0, 1.0]));
    assert_eq!(json["width"], 33);
}

#[test]
fn a_constant_offset_has_a_closed_form() {
    // Exact in f32. Both on the power curve of sRGB.
    let (t, r) = (0.75_f32, 0.5_f32);
    let c =
        compare(&picture(24, 16, |_, _| Vec3::splat(t)), &picture(24, 16, |_, _| Vec3::splat(r)))
            .unwrap();
    let encode = |v: f64| 1.055 * v.powf(1.0 / 2.4) - 0.055;
    let lightness = |y: f64| 116.0 * y.powf(1.0 / 3.0) - 16.0;
    let (et, er) = (encode(0.75), encode(0.5));
    // No variance: what is left of SSIM is the luminance term.
    let ssim = (2.0 * et * er + 1e-4) / (et * et + er * er + 1e-4);
    let want = Comparison {
        width: 24,
        height: 16,
        mean_test: [0.75; 3],
        mean_reference: [0.5; 3],
        mean_ratio: [1.5; 3],
        mse: 0.0625,
        rmse: 0.25,
        relative_rmse: 0.5,
        psnr_db: -20.0 * (et - er).log10(),
        ssim: Some(ssim),
        mean_lightness_error: lightness(0.75) - lightness(0.5),
        mean_flip: c.mean_flip,
    };
    assert_near(&c, &want, 1e-12, 0.0);
    assert!(c.mean_flip > 0.1, "{}", c.mean_flip);
}

#[test]
fn black_against_white_is_the_end_of_every_scale() {
    let c =
        compare(&picture(48, 48, |_, _| Vec3::ZERO), &picture(48, 48, |_, _| Vec3::ONE)).unwrap();
    assert_eq!((c.mse, c.relative_rmse, c.mean_ratio), (1.0, 1.0, [0.0; 3]));
    // 1.055 − 0.055 is 1 but for the last bit.
    assert!(c.psnr_db.abs() < 1e-12, "{}", c.psnr_db);
    assert!((c.mean_lightness_error - 100.0).abs() < 1e-12);
    assert!((c.ssim.unwrap() - 1e-4 / (1.0 + 1e-4)).abs() < 1e-12);
    // FLIP's paper: black against white is 1 but for the lack of edges: 0.95 and more.
    assert!(c.mean_flip > 0.9 && c.mean_flip <= 1.0, "{}", c.mean_flip);
}

#[test]
fn display_values_are_clipped_and_linear_values_are_not() {
    let c = compare(
        &picture(12, 12, |_, _| Vec3::splat(9.0)),
        &picture(12, 12, |_, _| Vec3::splat(5.0)),
    )
    .unwrap();
    assert_eq!((c.rmse, c.mean_ratio, c.psnr_db), (4.0, [1.8; 3], f64::INFINITY));
    assert_eq!((c.mean_lightness_error, c.mean_flip), (0.0, 0.0));
    let c =
        compare(&picture(12, 12, |_, _| Vec3::splat(-1.0)), &picture(12, 12, |_, _| Vec3::ZERO))
            .unwrap();
    assert_eq!((c.rmse, c.psnr_db, c.mean_flip), (1.0, f64::INFINITY, 0.0));
}

#[test]
fn a_mean_of_zero() {
    let c = compare(
        &picture(3, 3, |_, _| Vec3::new(2.0, 0.0, -1.0)),
        &picture(3, 3, |_, _| Vec3::ZERO),
    )
    .unwrap();
    assert_eq!(c.mean_ratio, [f64::INFINITY, 1.0, f64::NEG_INFINITY]);
    assert_eq!(c.relative_rmse, f64::INFINITY);
    assert_eq!(c.to_json()["mean_ratio"], serde_json::json!([null, 1.0, null]));
    assert_eq!(compare(&black(), &black()).unwrap().relative_rmse, 0.0);
}

fn black() -> Picture {
    picture(3, 3, |_, _| Vec3::ZERO)
}

#[test]
fn ssim_needs_eleven_pixels() {
    for (width, height, has_ssim) in
        [(11, 11, true), (10, 11, false), (11, 10, false), (1, 1, false), (300, 1, false)]
    {
        let p = picture(width, height, |x, y| Vec3::splat((x + y) as f32 / 512.0));
        let c = compare(&p, &p).unwrap();
        assert_eq!(c.ssim.is_some(), has_ssim, "{width} x {height}");
        assert_eq!(c.to_json()["ssim"].is_null(), !has_ssim);
    }
}

#[test]
fn flip_and_ssim_see_what_a_mean_does_not() {
    // The same pixels in another order: the same mean.
    let stripes = picture(32, 32, |x, _| Vec3::splat((x % 2) as f32));
    let shifted = picture(32, 32, |x, _| Vec3::splat(((x + 1) % 2) as f32));
    let c = compare(&shifted, &stripes).unwrap();
    assert_eq!(c.mean_ratio, [1.0; 3]);
    assert!(c.ssim.unwrap() < -0.9, "{:?}", c.ssim);
}

#[test]
fn the_difference_picture_is_the_magma_map() {
    let (test, reference) = pair("cornell_96x72_direct.png", "cornell_96x72.png");
    let d = difference_picture(&test, &reference).unwrap();
    assert_eq!((d.width, d.height, d.rgb.len()), (96, 72, 96 * 72));
    let path = empty_folder("difference").join("d.png");
    d.write(&path, &PngOptions::default()).unwrap();
    let bytes = image::open(&path).unwrap().into_rgb8();
    // flip-evaluator's map has its largest error, 0.9507, at column 57, row 64: magma's colour for it.
    let got = bytes.get_pixel(57, 64).0;
    let want = [252.88, 229.15, 166.82];
    // One entry of the map is one step of 255.
    assert!(got.iter().zip(want).all(|(&g, w)| (f64::from(g) - w).abs() < 3.0), "{got:?} {want:?}");
    let same = difference_picture(&reference, &reference).unwrap();
    // Magma's first colour is (0, 0, 4)/255 at the most.
    assert!(same.rgb.iter().all(|v| v.max_element() < 0.002), "{:?}", same.rgb[0]);
}

#[test]
fn what_cannot_be_compared_says_why() {
    let good = picture(4, 3, |_, _| Vec3::ONE);
    let error = compare(&good, &picture(3, 4, |_, _| Vec3::ONE)).unwrap_err();
    assert!(matches!(error, CompareError::SizeMismatch { test: [4, 3], reference: [3, 4] }));
    assert!(error.to_string().contains("4 x 3") && error.to_string().contains("3 x 4"), "{error}");

    for (value, shown) in [(f32::NAN, "NaN"), (f32::INFINITY, "inf"), (f32::NEG_INFINITY, "-inf")] {
        let mut bad = good.clone();
        bad.rgb[4 * 2 + 1].y = value;
        for (test, reference, side) in [(&bad, &good, Side::Test), (&good, &bad, Side::Reference)] {
            let error = compare(test, reference).unwrap_err();
            assert!(matches!(
                &error,
                CompareError::Unusable { side: s, source: PictureError::NotFinite { x: 1, y: 2, .. } } if *s == side
            ));
            let text = error.to_string();
            assert!(
                text.contains(&side.to_string())
                    && text.contains("column 1, row 2")
                    && text.contains(shown),
                "{text}"
            );
            assert!(difference_picture(test, reference).is_err());
        }
    }

    let short = Picture { width: 4, height: 3, rgb: vec![Vec3::ONE; 11] };
    assert!(matches!(compare(&short, &good), Err(CompareError::Unusable { side: Side::Test, .. })));
    let empty = Picture::default();
    assert!(matches!(
        compare(&empty, &empty),
        Err(CompareError::Unusable { source: PictureError::Empty { .. }, .. })
    ));
}
