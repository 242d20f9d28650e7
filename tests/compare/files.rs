// SPDX-License-Identifier: MIT OR Apache-2.0
//! Image files: transfer functions, round trips, formats of others, damaged and lying files, whole-file writing.

use std::io::Write as _;
use std::path::{Path, PathBuf};

use glam::{DVec3, Vec3};
use lucerna::picture::tone_map::khronos_pbr_neutral;
use lucerna::picture::{
    Format, MAX_PIXELS, Picture, PictureError, PngOptions, ToneMap, srgb, write_whole_file,
};

use crate::support::{Random, empty_folder, fixture, names_in, picture};

fn write_bytes(folder: &Path, name: &str, bytes: &[u8]) -> PathBuf {
    let path = folder.join(name);
    // Some file systems flush a file that is cut to nothing and written again: thousands of times here.
    let _ = std::fs::remove_file(&path);
    std::fs::write(&path, bytes).unwrap();
    path
}

/// A file of each format, each with structure enough to break.
fn small_files() -> Vec<(&'static str, Vec<u8>)> {
    let folder = empty_folder("small_files");
    let mut random = Random(5);
    let p = picture(19, 13, |x, _| {
        if x < 9 {
            Vec3::new(0.25, 0.5, 1.0)
        } else {
            Vec3::from(std::array::from_fn(|_| random.unit() as f32))
        }
    });
    let mut files = Vec::new();
    for name in ["p.png", "p.exr", "p.hdr"] {
        p.write(folder.join(name), &PngOptions::default()).unwrap();
        files.push((name, std::fs::read(folder.join(name)).unwrap()));
    }
    let bytes: Vec<u8> = (0..19 * 13 * 3).map(|i| (i * 7 % 256) as u8).collect();
    let mut jpeg = Vec::new();
    image::codecs::jpeg::JpegEncoder::new(&mut jpeg)
        .encode(&bytes, 19, 13, image::ExtendedColorType::Rgb8)
        .unwrap();
    files.push(("p.jpg", jpeg));
    for name in ["luminance_8x6.exr", "window_8x6.exr", "tiled_20x12.exr"] {
        files.push((name, std::fs::read(fixture(name)).unwrap()));
    }
    files
}

// --- transfer function and tone map ------------------------------------------------------------

#[test]
fn srgb_is_iec_61966_2_1() {
    // Published values, to the digits that f64 carries.
    for (encoded, linear) in [
        (0.0, 0.0),
        (0.02, 0.02 / 12.92),
        (0.5, 0.214_041_140_482_232_55),
        (128.0 / 255.0, 0.215_860_500_113_899_26),
        (188.0 / 255.0, 0.502_886_458_032_568_7),
        (1.0, 1.0),
    ] {
        assert!((srgb::linear_from_encoded(encoded) - linear).abs() < 1e-15, "{encoded}");
        assert!((srgb::encoded_from_linear(linear) - encoded).abs() < 1e-15, "{linear}");
    }
    // An oracle by logarithms, over all bytes and words and beside the threshold.
    let oracle =
        |e: f64| if e <= 0.04045 { e / 12.92 } else { (2.4 * ((e + 0.055) / 1.055).ln()).exp() };
    for byte in 0..=u8::MAX {
        let linear = srgb::linear_from_byte(byte);
        let want = oracle(f64::from(byte) / 255.0);
        // Rounded to f32 once.
        assert!(
            (f64::from(linear) - want).abs() <= want * 2f64.powi(-24) + 1e-15,
            "{byte}: {linear} {want}"
        );
        assert_eq!(srgb::byte_from_linear(linear.into()), byte);
    }
    for word in 0..=u16::MAX {
        let encoded = f64::from(word) / 65535.0;
        assert!((srgb::linear_from_encoded(encoded) - oracle(encoded)).abs() < 1e-14);
    }
    assert_eq!(
        [-1.0, 0.0, 1.0, 7.0, f64::INFINITY, f64::NAN].map(srgb::byte_from_linear),
        [0, 0, 255, 255, 255, 0]
    );
}

#[test]
fn bytes_are_rounded_to_nearest() {
    for byte in 0..255_u8 {
        let middle = srgb::linear_from_encoded((f64::from(byte) + 0.5) / 255.0);
        assert_eq!(srgb::byte_from_linear(middle * (1.0 - 1e-9)), byte);
        assert_eq!(srgb::byte_from_linear(middle * (1.0 + 1e-9)), byte + 1);
    }
}

#[test]
fn khronos_pbr_neutral_as_published() {
    // The specification's formula, in f64, step by step as printed there.
    let oracle = |c: DVec3| {
        let (start, desaturation) = (0.8 - 0.04, 0.15);
        let x = c.x.min(c.y).min(c.z);
        let c = c - if x < 0.08 { x - 6.25 * x * x } else { 0.04 };
        let peak = c.x.max(c.y).max(c.z);
        if peak < start {
            return c;
        }
        let d = 1.0 - start;
        let new_peak = 1.0 - d * d / (peak + d - start);
        let c = c * (new_peak / peak);
        let g = 1.0 - 1.0 / (desaturation * (peak - new_peak) + 1.0);
        c * (1.0 - g) + DVec3::splat(new_peak) * g
    };
    let mut random = Random(2);
    for _ in 0..10_000 {
        let rgb = Vec3::from(std::array::from_fn(|_| (20.0 * random.unit() - 10.0).exp2() as f32));
        let (got, want) = (khronos_pbr_neutral(rgb).as_dvec3(), oracle(rgb.as_dvec3()));
        // Values below 1 after a dozen f32 roundings; the offset's difference is scaled by 1/peak before it can grow.
        assert!((got - want).abs().max_element() < 2e-6, "{rgb}: {got} {want}");
        assert!(got.min_element() >= -1e-6 && got.max_element() <= 1.0);
    }
    // Base colours between 0.08 and 0.8 come out as they went in, less the 0.04 of Fresnel.
    assert!(
        (khronos_pbr_neutral(Vec3::new(0.5, 0.3, 0.1)) - Vec3::new(0.46, 0.26, 0.06))
            .abs()
            .max_element()
            < 1e-6
    );
    assert_eq!(khronos_pbr_neutral(Vec3::ZERO), Vec3::ZERO);
    assert_eq!(khronos_pbr_neutral(Vec3::splat(-3.0)), Vec3::ZERO);
    for huge in [f32::MAX, f32::INFINITY] {
        assert!((khronos_pbr_neutral(Vec3::new(huge, 0.0, 1.0)) - 1.0).abs().max_element() < 1e-6);
    }
}

// --- round trips ---------------------------------------------------------------------------------

#[test]
fn png_holds_display_bytes() {
    let folder = empty_folder("png");
    let path = folder.join("p.png");
    // Every byte, three channels apart.
    let p = picture(256, 2, |x, y| {
        let byte = |i: u32| srgb::linear_from_byte(((x + 85 * i + 7 * y) % 256) as u8);
        Vec3::new(byte(0), byte(1), byte(2))
    });
    p.write(&path, &PngOptions::default()).unwrap();
    assert_eq!(Picture::read(&path).unwrap(), p);

    // Exposure doubles, a tone map comes after it.
    let v = Vec3::new(0.01, 0.125, 0.75);
    let one = |options: &PngOptions| {
        picture(1, 1, |_, _| v).write(&path, options).unwrap();
        image::open(&path).unwrap().into_rgb8().get_pixel(0, 0).0
    };
    let bytes = |v: Vec3| v.to_array().map(|v| srgb::byte_from_linear(v.into()));
    assert_eq!(
        one(&lucerna::settings!(PngOptions { exposure_ev: 2.0, tone_map: None })),
        bytes(v * 4.0)
    );
    assert_eq!(
        one(&lucerna::settings!(PngOptions { exposure_ev: -1.0, tone_map: None })),
        bytes(v * 0.5)
    );
    let tone_map = Some(ToneMap::KhronosPbrNeutral);
    assert_eq!(
        one(&lucerna::settings!(PngOptions { exposure_ev: 1.0, tone_map })),
        bytes(khronos_pbr_neutral(v * 2.0))
    );
    assert_eq!(one(&lucerna::settings!(PngOptions { exposure_ev: 1e9, tone_map: None })), [255; 3]);
    assert_eq!(one(&lucerna::settings!(PngOptions { exposure_ev: -1e9, tone_map })), [0; 3]);
}

#[test]
fn exr_is_exact_to_the_bit() {
    let folder = empty_folder("exr");
    let special = [
        0.0,
        -0.0,
        f32::NAN,
        f32::INFINITY,
        f32::NEG_INFINITY,
        f32::MIN_POSITIVE,
        1e-45,
        f32::MAX,
        -3.25,
    ];
    let mut random = Random(3);
    for (width, height) in [(1, 1), (7, 5), (100, 33), (1, 40), (300, 1)] {
        let p = picture(width, height, |_, _| {
            Vec3::from(std::array::from_fn(|_| match random.next() as usize % 20 {
                i if i < special.len() => special[i],
                _ => f32::from_bits((random.next() & 0x7f7f_ffff) as u32),
            }))
        });
        let path = folder.join("p.exr");
        p.write(
            &path,
            &lucerna::settings!(PngOptions {
                exposure_ev: 5.0,
                tone_map: Some(ToneMap::KhronosPbrNeutral)
            }),
        )
        .unwrap();
        let back = Picture::read(&path).unwrap();
        let bits =
            |p: &Picture| p.rgb.iter().map(|v| v.to_array().map(f32::to_bits)).collect::<Vec<_>>();
        assert_eq!((back.width, back.height), (width, height));
        assert_eq!(bits(&back), bits(&p));
    }
}

#[test]
fn hdr_is_near_to_a_256th_of_the_largest_channel() {
    let folder = empty_folder("hdr");
    let path = folder.join("p.hdr");
    let mut random = Random(4);
    // Widths with and without run-length coding; runs, noise, and exponents to both ends.
    for width in [1, 7, 8, 128, 129, 400] {
        let p = picture(width, 24, |x, y| match (x / 5 + y) % 4 {
            0 => Vec3::ZERO,
            1 => Vec3::new(1.0, 0.996_2, 0.5),
            _ => {
                let scale = (250.0 * random.unit() - 126.0).exp2();
                Vec3::from(std::array::from_fn(|_| (scale * random.unit()) as f32))
            }
        });
        p.write(&path, &PngOptions::default()).unwrap();
        let back = Picture::read(&path).unwrap();
        assert_eq!((back.width, back.height, back.rgb.len()), (p.width, p.height, p.rgb.len()));
        for (&got, &want) in back.rgb.iter().zip(&p.rgb) {
            // Half a step of 2^(k-7), where the largest channel is at least 2^k; and f32's last denormals.
            let allowed = f64::from(want.max_element()) / 256.0 + 1e-45;
            let off = (got.as_dvec3() - want.as_dvec3()).abs().max_element();
            assert!(off <= allowed, "{want} came back as {got}");
        }
        // What has been rounded once stays, and others read the same.
        back.write(&path, &PngOptions::default()).unwrap();
        assert_eq!(Picture::read(&path).unwrap(), back);
        let theirs = image::open(&path).unwrap().into_rgb32f();
        assert!(theirs.pixels().zip(&back.rgb).all(|(t, b)| Vec3::from(t.0) == *b));
    }
    let ends = Picture {
        width: 4,
        height: 1,
        rgb: vec![
            Vec3::new(-5.0, 1.0, -0.0),
            Vec3::splat(f32::MAX),
            Vec3::splat(1e-45),
            Vec3::new(255.9, 1.0, 0.0),
        ],
    };
    ends.write(&path, &PngOptions::default()).unwrap();
    let back = Picture::read(&path).unwrap();
    let largest = (255.0 * 2f64.powi(119)) as f32;
    // 255.9 rounds up to the next power of two, where the step is 2.
    assert_eq!(back.rgb, [Vec3::Y, Vec3::splat(largest), Vec3::ZERO, Vec3::new(256.0, 2.0, 0.0)]);
}

// --- files that others wrote ------------------------------------------------------------------

#[test]
fn sixteen_bits_grey_and_alpha() {
    let folder = empty_folder("png_kinds");
    let path = folder.join("p.png");
    let linear = |v: u16| srgb::linear_from_encoded(f64::from(v) / 65535.0) as f32;
    let words: Vec<u16> = (0..64).map(|i| i * 1031).collect();
    image::ImageBuffer::<image::Rgb<u16>, _>::from_fn(8, 8, |x, y| {
        let w = words[(y * 8 + x) as usize];
        image::Rgb([w, w / 2, 65535 - w])
    })
    .save(&path)
    .unwrap();
    let p = Picture::read(&path).unwrap();
    for (rgb, &w) in p.rgb.iter().zip(&words) {
        assert_eq!(*rgb, Vec3::new(linear(w), linear(w / 2), linear(65535 - w)));
    }
    image::ImageBuffer::<image::LumaA<u16>, _>::from_pixel(2, 2, image::LumaA([700, 3]))
        .save(&path)
        .unwrap();
    assert_eq!(Picture::read(&path).unwrap().rgb, [Vec3::splat(linear(700)); 4]);
    // Alpha is ignored, not multiplied in.
    image::RgbaImage::from_pixel(2, 1, image::Rgba([10, 200, 30, 0])).save(&path).unwrap();
    assert_eq!(
        Picture::read(&path).unwrap().rgb,
        [Vec3::from([10, 200, 30].map(srgb::linear_from_byte)); 2]
    );
    image::GrayImage::from_pixel(1, 2, image::Luma([99])).save(&path).unwrap();
    assert_eq!(Picture::read(&path).unwrap().rgb, [Vec3::splat(srgb::linear_from_byte(99)); 2]);
}

#[test]
fn jpeg_by_content_whatever_its_name() {
    let folder = empty_folder("jpeg");
    for color in [image::ExtendedColorType::Rgb8, image::ExtendedColorType::L8] {
        let n = usize::from(color.channel_count());
        let mut jpeg = Vec::new();
        let bytes: Vec<u8> = [200, 100, 50][..n].repeat(24 * 16);
        image::codecs::jpeg::JpegEncoder::new_with_quality(&mut jpeg, 100)
            .encode(&bytes, 24, 16, color)
            .unwrap();
        let p = Picture::read(write_bytes(&folder, "says_it_is.png", &jpeg)).unwrap();
        assert_eq!((p.width, p.height), (24, 16));
        let want = if n == 3 { [200, 100, 50] } else { [200; 3] };
        for rgb in &p.rgb {
            for c in 0..3 {
                // YCbCr and back: two bytes at the most.
                let byte = srgb::byte_from_linear(rgb[c].into());
                assert!(byte.abs_diff(want[c]) <= 2, "{byte} {want:?}");
            }
        }
    }
}

#[test]
fn exr_of_openexr() {
    // Written by the OpenEXR library; see fixtures/compare/README.md.
    let grey = Picture::read(fixture("luminance_8x6.exr")).unwrap();
    assert_eq!(grey, picture(8, 6, |x, y| Vec3::splat(((y * 8 + x) as f32 - 8.0) * 0.25)));
    let tiled = Picture::read(fixture("tiled_20x12.exr")).unwrap();
    assert_eq!(tiled, picture(20, 12, |x, y| Vec3::new(x as f32, y as f32, -3.5)));
    // Half RGBA, PIZ, with a data window of columns 2..=5 and rows 1..=3 in a display window of 8 x 6.
    let window = Picture::read(fixture("window_8x6.exr")).unwrap();
    let want = picture(8, 6, |x, y| {
        let inside = (2..=5).contains(&x) && (1..=3).contains(&y);
        if inside { Vec3::new((x - 1) as f32, y as f32, 0.5) } else { Vec3::ZERO }
    });
    assert_eq!(window, want);
    let error = Picture::read(fixture("depth_only_4x4.exr")).unwrap_err();
    assert!(
        matches!(&error, PictureError::NoColorChannels { found, .. } if found == "Z"),
        "{error}"
    );
}

#[test]
fn hdr_headers_and_both_kinds_of_runs() {
    let folder = empty_folder("hdr_kinds");
    let read = |bytes: &[u8]| Picture::read(write_bytes(&folder, "p.hdr", bytes));
    // Old-style: one pixel, a run of 1, then two marks in a row: 2 + 1·256; 260 pixels in all.
    let mut old = b"#?RGBE\n# made by hand\nEXPOSURE=2\nEXPOSURE= 4\r\nCOLORCORR=1 2 0.5\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 260\n".to_vec();
    old.extend([128, 64, 0, 129, 1, 1, 1, 1, 1, 1, 1, 2, 1, 1, 1, 1]);
    // 1 + 1, then marks that follow the first directly count 256 and 65536 times: keep them apart by a pixel.
    let error = read(&old).unwrap_err();
    assert!(matches!(error, PictureError::Decode { format: Format::Hdr, .. }), "{error}");
    old.truncate(old.len() - 12);
    old.extend([1, 1, 1, 3, 1, 1, 1, 1]);
    let p = read(&old).unwrap();
    // 128·2^(129−136) = 1, over exposures 2·4 and corrections.
    assert_eq!(p.rgb, [Vec3::new(1.0 / 8.0, 0.5 / 16.0, 0.0); 260]);

    let mut new = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 8\n\x02\x02\x00\x08".to_vec();
    new.extend([128 + 8, 128, 3, 1, 2, 3, 128 + 5, 9, 8, 0, 0, 0, 0, 0, 0, 0, 0, 128 + 8, 136]);
    let want = [1, 2, 3, 9, 9, 9, 9, 9].map(|g| Vec3::new(128.0, g as f32, 0.0));
    assert_eq!(read(&new).unwrap().rgb, want);

    for (header, says) in [
        ("FORMAT=32-bit_rle_xyze\n\n-Y 1 +X 1\n", "32-bit_rle_xyze"),
        ("EXPOSURE=0\n\n-Y 1 +X 1\n", "EXPOSURE"),
        ("EXPOSURE=nan\n\n-Y 1 +X 1\n", "EXPOSURE"),
        ("EXPOSURE=much\n\n-Y 1 +X 1\n", "EXPOSURE=much"),
        ("COLORCORR=1 1\n\n-Y 1 +X 1\n", "COLORCORR=1 1"),
        ("\n+Y 1 +X 1\n", "upright"),
        ("\n-Y one +X 1\n", "-Y one"),
        ("", "header"),
    ] {
        let error = read(format!("#?RADIANCE\n{header}\u{1}\u{1}\u{1}\u{7f}").as_bytes())
            .unwrap_err()
            .to_string();
        assert!(error.contains(says) && error.contains("p.hdr"), "{error}");
    }
}

// --- hostile files ---------------------------------------------------------------------------------

#[test]
fn a_file_cut_short_is_an_error() {
    let folder = empty_folder("cut");
    for (name, bytes) in small_files() {
        let whole = Picture::read(write_bytes(&folder, name, &bytes)).unwrap();
        for length in 0..bytes.len() {
            match Picture::read(write_bytes(&folder, name, &bytes[..length])) {
                // Only what comes after the last pixel may be missing.
                Ok(p) => assert_eq!(p, whole, "{name} cut to {length} of {}", bytes.len()),
                Err(e) => assert!(
                    e.to_string().contains(name) && !e.to_string().contains("gave up"),
                    "{e}"
                ),
            }
        }
        // A third is never enough.
        assert!(
            Picture::read(write_bytes(&folder, name, &bytes[..bytes.len() / 3])).is_err(),
            "{name}"
        );
    }
}

#[test]
fn damaged_bytes_never_panic_or_hang() {
    let folder = empty_folder("damaged");
    let mut random = Random(6);
    for (name, bytes) in small_files() {
        for _ in 0..500 {
            let mut bytes = bytes.clone();
            for _ in 0..1 + random.next() % 3 {
                let at = random.next() as usize % bytes.len();
                bytes[at] = match random.next() % 3 {
                    0 => 0xff,
                    1 => 0,
                    _ => random.next() as u8,
                };
            }
            if let Ok(p) = Picture::read(write_bytes(&folder, name, &bytes)) {
                p.check_size().unwrap();
            }
        }
    }
}

/// CRC-32 of a PNG chunk (PNG specification, annex D), bit by bit.
fn crc32(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(!0, |crc, &b| {
        (0..8).fold(crc ^ u32::from(b), |c, _| (c >> 1) ^ (0xedb8_8320 * (c & 1)))
    })
}

/// The `n`th byte after the first place where `what` stands.
fn after(bytes: &[u8], what: &[u8], n: usize) -> usize {
    bytes.windows(what.len()).position(|w| w == what).unwrap() + what.len() + n
}

#[test]
fn files_that_lie_about_their_size() {
    let folder = empty_folder("lies");
    let files = small_files();
    let of = |name: &str| files.iter().find(|f| f.0 == name).unwrap().1.clone();
    let side = |v: u32| v.to_be_bytes();

    for (width, height) in [(0x7fff_ffff, 0x7fff_ffff), (65_536, 65_536), (8192, 8193), (0, 5)] {
        let mut png = of("p.png");
        png[16..20].copy_from_slice(&side(width));
        png[20..24].copy_from_slice(&side(height));
        let crc = crc32(&png[12..29]);
        png[29..33].copy_from_slice(&crc.to_be_bytes());
        let error = Picture::read(write_bytes(&folder, "big.png", &png)).unwrap_err();
        let is_size = matches!(error, PictureError::BadSize { .. });
        // The decoder may refuse first.
        assert!(is_size || matches!(error, PictureError::Decode { .. }), "{error}");

        let hdr = format!("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y {height} +X {width}\n");
        let error = Picture::read(write_bytes(&folder, "big.hdr", hdr.as_bytes())).unwrap_err();
        assert!(matches!(error, PictureError::BadSize { .. }), "{error}");
        assert!(error.to_string().contains(&MAX_PIXELS.to_string()), "{error}");
    }
    // As large as may be, and no pixel there.
    let hdr = "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 8192 +X 8192\n";
    let error = Picture::read(write_bytes(&folder, "big.hdr", hdr.as_bytes())).unwrap_err();
    assert!(error.to_string().contains("ends in row 0"), "{error}");

    // SOF0: marker, length, precision, height, width.
    let mut jpeg = of("p.jpg");
    let at = after(&jpeg, b"\xff\xc0", 3);
    jpeg[at..at + 4].copy_from_slice(&[0xff, 0xff, 0xff, 0xff]);
    let error = Picture::read(write_bytes(&folder, "big.jpg", &jpeg)).unwrap_err();
    assert!(
        matches!(error, PictureError::BadSize { width: 65_535, height: 65_535, .. }),
        "{error}"
    );

    // Windows: name, type, a size of 16, then least x, least y, largest x, largest y.
    for (window, largest) in [
        ("displayWindow", [99_999, 99_999]),
        ("dataWindow", [99_999, 99_999]),
        ("dataWindow", [2_000_000_000, 0]),
    ] {
        let mut exr = of("luminance_8x6.exr");
        let at = after(&exr, format!("{window}\0box2i\0").as_bytes(), 4 + 8);
        for (i, v) in largest.into_iter().enumerate() {
            exr[at + 4 * i..at + 4 * i + 4].copy_from_slice(&i32::to_le_bytes(v));
        }
        let error = Picture::read(write_bytes(&folder, "big.exr", &exr)).unwrap_err();
        assert!(
            matches!(error, PictureError::BadSize { .. } | PictureError::Decode { .. }),
            "{error}"
        );
    }
    let mut exr = of("tiled_20x12.exr");
    let at = after(&exr, b"tiles\0tiledesc\0", 4);
    exr[at..at + 8].copy_from_slice(&[0xff, 0xff, 0xff, 0x7f, 0xff, 0xff, 0xff, 0x7f]);
    let error = Picture::read(write_bytes(&folder, "tile.exr", &exr)).unwrap_err();
    assert!(matches!(error, PictureError::Decode { .. }), "{error}");
    assert!(!error.to_string().contains("gave up"), "{error}");
}

#[test]
fn what_is_no_image_says_so() {
    let folder = empty_folder("no_image");
    for bytes in [&b""[..], b"#?", b"P6\n1 1\n255\n...", b"GIF89a", b"\0\0\0\0"] {
        let path = write_bytes(&folder, "no.png", bytes);
        assert!(matches!(Picture::read(&path), Err(PictureError::UnknownFormat { .. })));
    }
    let error = Picture::read(&folder).unwrap_err();
    assert!(matches!(error, PictureError::NotAFile { .. }), "{error}");
    let error = Picture::read(folder.join("absent.exr")).unwrap_err();
    assert!(
        matches!(&error, PictureError::Read { source, .. } if source.kind() == std::io::ErrorKind::NotFound)
    );
    assert!(error.to_string().contains("absent.exr"), "{error}");
}

#[test]
fn the_first_value_that_is_not_finite() {
    let mut p = picture(5, 4, |_, _| Vec3::ONE);
    p.check_finite().unwrap();
    p.rgb[5 * 3 + 4].x = f32::INFINITY;
    p.rgb[5 * 2 + 3].z = f32::NAN;
    let error = p.check_finite().unwrap_err();
    assert!(matches!(error, PictureError::NotFinite { x: 3, y: 2, value, .. } if value.is_nan()));
    assert!(
        error.to_string().contains("column 3, row 2") && error.to_string().contains("blue"),
        "{error}"
    );
}

// --- writing whole or not at all ---------------------------------------------------------------------

#[test]
fn what_cannot_be_written_leaves_the_old_file() {
    let folder = empty_folder("refused");
    let good = picture(3, 2, |_, _| Vec3::ONE);
    let mut nan = good.clone();
    nan.rgb[4].y = f32::NAN;
    let short = Picture { rgb: vec![Vec3::ONE; 5], ..good.clone() };
    for ending in ["png", "hdr", "exr"] {
        let path = write_bytes(&folder, &format!("p.{ending}"), b"old");
        let written = nan.write(&path, &PngOptions::default());
        assert_eq!(written.is_ok(), ending == "exr");
        if let Err(error) = written {
            assert!(matches!(error, PictureError::NotFinite { x: 1, y: 1, .. }), "{error}");
            assert_eq!(std::fs::read(&path).unwrap(), b"old");
        }
        assert!(matches!(
            short.write(&path, &PngOptions::default()),
            Err(PictureError::WrongLength { n_pixels: 5, .. })
        ));
        assert!(matches!(
            Picture::default().write(&path, &PngOptions::default()),
            Err(PictureError::Empty { .. })
        ));
        good.write(&path, &PngOptions::default()).unwrap();
        assert_eq!(Picture::read(&path).unwrap(), good);
    }
    for name in ["p.jpg", "p", "p.", ".png", "p.png.txt"] {
        let error = good.write(folder.join(name), &PngOptions::default()).unwrap_err();
        assert!(matches!(error, PictureError::UnknownEnding { .. }), "{error}");
        assert!([".png", ".exr", ".hdr"].iter().all(|e| error.to_string().contains(e)), "{error}");
    }
    let options = lucerna::settings!(PngOptions { exposure_ev: f32::NAN, tone_map: None });
    assert!(matches!(
        good.write(folder.join("p.png"), &options),
        Err(PictureError::BadExposure { .. })
    ));
    good.write(folder.join("LOUD.PNG"), &PngOptions::default()).unwrap();
    assert_eq!(names_in(&folder), ["LOUD.PNG", "p.exr", "p.hdr", "p.png"]);
}

#[test]
fn a_folder_that_takes_no_file() {
    let folder = empty_folder("unwritable");
    let p = picture(2, 2, |_, _| Vec3::ONE);
    write_bytes(&folder, "a_file", b"");
    std::fs::create_dir(folder.join("a_folder.png")).unwrap();
    for name in ["missing/p.png", "a_file/p.exr", "a_folder.png"] {
        let error = p.write(folder.join(name), &PngOptions::default()).unwrap_err();
        assert!(matches!(error, PictureError::Write { .. }), "{error}");
        assert!(
            error.to_string().contains(name) && error.to_string().contains("folder"),
            "{error}"
        );
    }
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        let locked = folder.join("locked");
        std::fs::create_dir(&locked).unwrap();
        std::fs::set_permissions(&locked, std::fs::Permissions::from_mode(0o555)).unwrap();
        // The superuser may write all the same.
        match p.write(locked.join("p.hdr"), &PngOptions::default()) {
            Ok(()) => assert_eq!(names_in(&locked), ["p.hdr"]),
            Err(error) => {
                assert!(error.to_string().contains("locked"), "{error}");
                assert!(names_in(&locked).is_empty());
            }
        }
        std::fs::set_permissions(&locked, std::fs::Permissions::from_mode(0o755)).unwrap();
    }
    assert_eq!(names_in(&folder).first().map(String::as_str), Some("a_file"));
    assert!(names_in(&folder).iter().all(|n| !n.ends_with(".tmp")));
}

#[test]
fn a_write_that_fails_half_way_leaves_nothing() {
    let folder = empty_folder("half_way");
    let path = write_bytes(&folder, "p.bin", b"old");
    let failed = write_whole_file(&path, |w| {
        w.write_all(&[7; 100_000])?;
        assert_eq!(names_in(&folder).len(), 2);
        Err(std::io::Error::other("no more"))
    });
    assert_eq!(failed.unwrap_err().to_string(), "no more");
    assert_eq!(std::fs::read(&path).unwrap(), b"old");
    assert_eq!(names_in(&folder), ["p.bin"]);
    // Unwinding too.
    let unwound = std::panic::catch_unwind(|| {
        write_whole_file::<std::io::Error>(&path, |_| std::panic::resume_unwind(Box::new(1)))
    });
    assert!(unwound.is_err());
    assert_eq!(names_in(&folder), ["p.bin"]);
    write_whole_file(&path, |w| w.write_all(b"new")).unwrap();
    assert_eq!(std::fs::read(&path).unwrap(), b"new");
    assert_eq!(names_in(&folder), ["p.bin"]);
}

#[test]
fn the_same_picture_gives_the_same_bytes() {
    let folder = empty_folder("same_bytes");
    let p = picture(40, 30, |x, y| Vec3::new(x as f32, y as f32, 0.5) / 40.0);
    for ending in ["png", "hdr", "exr"] {
        let [a, b] = ["a", "b"].map(|name| {
            let path = folder.join(format!("{name}.{ending}"));
            p.write(&path, &PngOptions::default()).unwrap();
            std::fs::read(path).unwrap()
        });
        assert!(a == b, "{ending}");
    }
}
