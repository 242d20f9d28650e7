// SPDX-License-Identifier: MIT OR Apache-2.0
//! How scenes name their files, and what OBJ and MTL say that is not read.

use std::path::Path;

use glam::{Vec3, Vec4};
use lucerna::scene::{LoadLimits, Loaded, Scene};

use crate::builder::textured;
use crate::{TempDir, load_obj};

const QUAD: &str = "v 0 0 0\nv 2 0 0\nv 2 1 0\nv 0 1 0\n";

fn png() -> Vec<u8> {
    let mut bytes = Vec::new();
    image::RgbaImage::from_raw(1, 1, vec![10, 20, 30, 255])
        .unwrap()
        .write_to(&mut std::io::Cursor::new(&mut bytes), image::ImageFormat::Png)
        .unwrap();
    bytes
}

/// Writes files into a folder of their own, below which `name` is loaded.
fn load_folder(test: &str, files: &[(&str, &[u8])], name: &str) -> Loaded {
    let folder = TempDir::new(test);
    for (name, bytes) in files {
        let path = folder.0.join(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, bytes).unwrap();
    }
    let loaded = Scene::load(&folder.0.join(name), &LoadLimits::default()).unwrap();
    loaded.scene.validate().unwrap();
    loaded
}

fn shown(loaded: &Loaded) -> Vec<String> {
    loaded.warnings.iter().map(|w| w.to_string()).collect()
}

/// A quad with one material, `m`, of this library's text, beside `a b.png` and `sub/c.png`.
fn with_mtl(test: &str, mtl: &[u8]) -> Loaded {
    let obj = format!("mtllib sub/l.mtl\n{QUAD}vt 0 0\nusemtl m\nf 1/1 2/1 3/1 4/1\n");
    let png = png();
    let files = [
        ("s/scene.obj", obj.as_bytes()),
        ("s/sub/l.mtl", mtl),
        ("s/a b.png", &png),
        ("s/sub/c.png", &png),
        ("outside.png", &png),
    ];
    load_folder(test, &files, "s/scene.obj")
}

#[test]
fn texture_names() {
    for (i, (map, expected)) in [
        ("a b.png", None),
        ("\"a b.png\"", None),
        ("'a b.png' # wood", None),
        ("-s 1 1 1 \"a b.png\"", None),
        ("../a b.png", None),
        ("..\\a b.png", None),
        ("c.png # wood", None),
        ("sub/c.png", None),
        ("C.PNG", Some("material m: named `C.PNG`, but the file is called `sub/c.png`")),
        ("A B.png", Some("material m: named `A B.png`, but the file is called `a b.png`")),
        ("../../outside.png", Some("leads out of the scene's folder")),
        ("nowhere.png", Some("cannot read nowhere.png")),
    ]
    .into_iter()
    .enumerate()
    {
        let loaded = with_mtl(&format!("map{i}"), format!("newmtl m\nmap_Kd {map}\n").as_bytes());
        let shown = shown(&loaded);
        match expected {
            None => assert!(shown.is_empty(), "{map}: {shown:#?}"),
            // Other file systems find a name in any case.
            Some(text) if text.contains("named") && !cfg!(target_os = "linux") => {}
            Some(text) => assert!(shown.len() == 1 && shown[0].contains(text), "{map}: {shown:#?}"),
        }
        let is_missing = expected.is_some_and(|text| !text.contains("named"));
        assert_eq!(loaded.scene.images[0].rgba == [[255; 4]], is_missing, "{map}");
    }
}

#[test]
fn latin_1_is_read() {
    let png = png();
    let files: [(&str, &[u8]); 3] = [
        (
            "s.obj",
            b"mtllib l.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nusemtl gr\xc3\xbcn\nf 1/1 2/1 3/1\n",
        ),
        ("l.mtl", b"newmtl gr\xfcn\nmap_Kd gr\xfcn.png\n"),
        ("gr\u{fc}n.png", &png),
    ];
    let loaded = load_folder("latin", &files, "s.obj");
    assert_eq!(loaded.scene.materials[0].name, "grün");
    assert_eq!(loaded.scene.images[0].rgba, [[10, 20, 30, 255]]);
    assert_eq!(shown(&loaded), ["mtllib l.mtl, line 1: not UTF-8, read as Latin-1"]);
}

#[test]
fn values_before_the_first_material_are_named() {
    let loaded = with_mtl("before", b"# none\nKd 1 0 0\nKs 1 1 1\nnewmtl m\nKd 0 1 0\n");
    assert_eq!(
        shown(&loaded),
        ["mtllib sub/l.mtl, line 2: 2 statement(s) before the first `newmtl`, skipped"]
    );
    assert_eq!(loaded.scene.materials[0].base_color, Vec4::new(0., 1., 0., 1.));
}

#[test]
fn an_emissive_map_that_is_missing_is_dark() {
    let loaded = with_mtl("dark", b"newmtl m\nKe 3 3 3\nmap_Ke nowhere.png\n");
    assert_eq!(loaded.scene.materials[0].emission, Vec3::ZERO);
    assert_eq!(loaded.scene.materials[0].emission_texture, None);
    let shown = shown(&loaded);
    assert!(shown[1].contains("material m: map_Ke cannot be read, so that it emits nothing"));
}

#[test]
fn gltf_names() {
    let png = png();
    for (i, (uri, file, warns)) in [
        ("a%20b.png", "a b.png", false),
        ("a b.png", "a b.png", false),
        ("a%20b.png", "a%20b.png", false),
        ("100%.png", "100%.png", false),
        ("50%25.png", "50%.png", false),
        ("a.png?v=2", "a.png", false),
        ("x/./../a.png", "a.png", false),
        ("T/A.PNG", "t/a.png", true),
        // Letter and accent apart, as macOS writes names.
        ("gru\u{308}n.png", "grün.png", true),
        ("gr%C3%BCn.png", "gru\u{308}n.png", true),
    ]
    .into_iter()
    .enumerate()
    {
        let text = textured(&format!(
            r#""images":[{{"uri":"{uri}"}}],"textures":[{{"source":0}}],
            "materials":[{{"pbrMetallicRoughness":{{"baseColorTexture":{{"index":0}}}}}}]"#
        ));
        let warns = warns && cfg!(target_os = "linux");
        let test = format!("uri{i}");
        let loaded = load_folder(&test, &[("s.gltf", &text), (file, &png)], "s.gltf");
        let shown = shown(&loaded);
        assert_eq!(loaded.scene.images[0].rgba, [[10, 20, 30, 255]], "{uri}: {shown:#?}");
        assert_eq!(shown.len(), usize::from(warns), "{uri}: {shown:#?}");
        assert!(!warns || shown[0].contains("but the file is called"), "{uri}: {shown:#?}");
    }
}

#[test]
fn utf_16_is_read_and_named() {
    let text = format!("{QUAD}f 1 2 3 4\r\n");
    let units: Vec<u16> = text.encode_utf16().collect();
    let little: Vec<u8> = units.iter().flat_map(|u| u.to_le_bytes()).collect();
    let big: Vec<u8> = units.iter().flat_map(|u| u.to_be_bytes()).collect();
    for bytes in [
        [b"\xff\xfe", &little[..]].concat(),
        [b"\xfe\xff", &big[..]].concat(),
        little.clone(),
        big.clone(),
    ] {
        let loaded = Scene::from_obj_slice(&bytes, None, &LoadLimits::default()).unwrap();
        assert_eq!(shown(&loaded), ["OBJ: the text is UTF-16, read as such; save it as UTF-8"]);
        assert_eq!(loaded.scene.bounds().unwrap().1, Vec3::new(2., 1., 0.));
    }
    let wide: Vec<u8> = text.chars().flat_map(|c| u32::from(c).to_le_bytes()).collect();
    let loaded = Scene::from_obj_slice(&wide, None, &LoadLimits::default()).unwrap();
    assert!(shown(&loaded)[0].contains("UTF-16 or UTF-32; save it as UTF-8"));

    let mtl: Vec<u8> = "newmtl m\nKd 1 0 0\n".encode_utf16().flat_map(u16::to_le_bytes).collect();
    let loaded = with_mtl("utf16", &[b"\xff\xfe", &mtl[..]].concat());
    assert_eq!(
        shown(&loaded),
        ["mtllib sub/l.mtl: the text is UTF-16, read as such; save it as UTF-8"]
    );
    assert_eq!(loaded.scene.materials[0].base_color, Vec4::new(1., 0., 0., 1.));

    for bytes in [&b"\xff\xfe{\0"[..], b"\xfe\xff\0{", b"{\0\"\0", b"\0{\0\""] {
        let error = Scene::from_gltf_slice(bytes, None, &LoadLimits::default()).unwrap_err();
        assert!(error.to_string().contains("UTF-16"), "{error}");
    }
}

#[test]
fn line_ends_may_be_mixed() {
    let text = "# old\rv 0 0 0\rv 2 0 \\\r0\nv 2 1 0\r\nv 0 1 \\\r\n 0\n\rf 1 2 \\\n3 4\rf 1 2 9";
    let loaded = load_obj(text);
    assert_eq!(loaded.scene.n_triangles(), 2);
    // Counted as an editor counts them: CR LF ends one line, LF CR two.
    let problem = "line 11: face with a vertex index out of range, skipped (1 in total)";
    assert_eq!(shown(&loaded), [problem]);
}

#[test]
fn unknown_keywords_are_named_once() {
    let text = format!(
        "{QUAD}s 1\nlod 3\nmg 1 2\nfoo 1\nF 1 2 3\nfoo 2\nusemap wood\ncall other.obj\nf 1 2 3 4\n"
    );
    let loaded = load_obj(&text);
    assert_eq!(loaded.scene.n_triangles(), 2);
    assert_eq!(
        shown(&loaded),
        [
            "line 9: `F` (unknown keyword), 1 in total, ignored",
            "line 8: `foo` (unknown keyword), 2 in total, ignored",
            "line 12: `call` (not supported), 1 in total, ignored",
            "line 11: `usemap` (not supported), 1 in total, ignored",
        ]
    );
    let many: String = (0..500).map(|i| format!("k{i} 1\n")).collect();
    let loaded = load_obj(&format!("{QUAD}f 1 2 3 4\n{many}"));
    assert!(loaded.warnings.len() < 50, "{}", loaded.warnings.len());
    assert!(shown(&loaded).last().unwrap().contains("468 more line(s) of unknown keywords"));
}

#[test]
fn keywords_of_libraries() {
    let harmless = b"newmtl m\nKa 1 1 1\nmap_Ka c.png\nillum 2\nNi 1.5\nsharpness 60\nTf 1 1 1\n\
        Ps 0\nPc 0.0\nPcr 0\naniso 0\nanisor 0\n";
    let loaded = with_mtl("harmless", harmless);
    assert!(loaded.warnings.is_empty(), "{:#?}", shown(&loaded));

    let loaded = with_mtl(
        "effects",
        b"newmtl m\nTf 0.5 1 1\nmap_Pr c.png\nmap_Pr c.png\nrefl -type sphere c.png\nshine 3\n",
    );
    assert_eq!(
        shown(&loaded),
        [
            "mtllib sub/l.mtl, line 6: `shine` (unknown keyword), 1 in total, ignored",
            "mtllib sub/l.mtl, line 2: `Tf` (not supported), 1 in total, ignored",
            "mtllib sub/l.mtl, line 3: `map_Pr` (not supported), 2 in total, ignored",
            "mtllib sub/l.mtl, line 5: `refl` (not supported), 1 in total, ignored",
        ]
    );
    // In another case, and with decimal commas.
    let loaded = with_mtl("case", b"NEWMTL m\nKD 0,5 0,25 1\nmap_kd c.png\n");
    let material = &loaded.scene.materials[0];
    assert_eq!(material.base_color, Vec4::new(0.5, 0.25, 1., 1.));
    assert!(material.base_color_texture.is_some());
    assert_eq!(shown(&loaded), ["mtllib sub/l.mtl, line 2: decimal comma, read as a point"]);
}

#[test]
fn names_of_materials() {
    let obj = |name: &str| format!("mtllib l.mtl\n{QUAD}usemtl {name}\nf 1 2 3 4\n");
    let mtl = b"newmtl Material #25\nKd 1 0 0\nnewmtl Material #26\nKd 0 1 0\n\
        newmtl plain \nKd 0 0 1\nnewmtl noted # once\nKd 0 0 0\n";
    for (i, (name, color)) in [
        ("Material #25", Vec3::X),
        ("Material #26", Vec3::Y),
        ("plain\t# blue", Vec3::Z),
        ("plain  ", Vec3::Z),
        ("noted", Vec3::ZERO),
        ("noted # twice", Vec3::ZERO),
    ]
    .into_iter()
    .enumerate()
    {
        let files = [("s.obj", obj(name)), ("l.mtl", String::from_utf8_lossy(mtl).into_owned())];
        let files: Vec<(&str, &[u8])> = files.iter().map(|(n, t)| (*n, t.as_bytes())).collect();
        let loaded = load_folder(&format!("names{i}"), &files, "s.obj");
        assert!(loaded.warnings.is_empty(), "{name}: {:#?}", shown(&loaded));
        assert_eq!(loaded.scene.materials[0].base_color, color.extend(1.), "{name}");
    }
}

#[test]
fn a_library_in_a_folder_of_another_case() {
    let obj = format!("mtllib SUB\\L.mtl\n{QUAD}vt 0 0\nusemtl m\nf 1/1 2/1 3/1\n");
    let png = png();
    let files: [(&str, &[u8]); 3] = [
        ("s.obj", obj.as_bytes()),
        ("sub/l.mtl", b"newmtl m\nmap_Kd c.png\n"),
        ("sub/c.png", &png),
    ];
    let loaded = load_folder("folder", &files, "s.obj");
    assert_eq!(loaded.scene.images[0].rgba, [[10, 20, 30, 255]]);
    if cfg!(target_os = "linux") {
        // One for the library; its texture is named as it is called.
        let named =
            "mtllib SUB\\L.mtl: named `SUB\\L.mtl`, but the file is called `sub/l.mtl`; it is read";
        assert_eq!(shown(&loaded), [named]);
    }
}

#[test]
fn libraries_that_are_missing_are_named_one_by_one() {
    let text = format!("mtllib my a.mtl b.mtl\n{QUAD}f 1 2 3 4\n");
    let folder = TempDir::new("none");
    let loaded =
        Scene::from_obj_slice(text.as_bytes(), Some(Path::new(&folder.0)), &LoadLimits::default());
    let shown = shown(&loaded.unwrap());
    assert_eq!(shown.len(), 2, "{shown:#?}");
    assert!(shown[0].starts_with("mtllib my a.mtl: cannot read my a.mtl"), "{shown:#?}");
    assert!(shown[1].starts_with("mtllib b.mtl: cannot read b.mtl"), "{shown:#?}");
}
