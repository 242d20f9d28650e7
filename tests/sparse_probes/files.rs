// SPDX-License-Identifier: MIT OR Apache-2.0
//! Bakes as files: the same bytes each time, whole or not at all, in parts that are joined.

use crate::harness::{differing_bytes, gpu};
use crate::session::{lit_room, upload};
use crate::{baked, begun, eye, filled, meshes_of, session, small};
use lucerna::blocking::{SparseBakeError, SparseScene, bake_sparse_probes};
use lucerna::components::sparse_probes::{SparseBake, SparseError, SparseSettings, is_in_shard};
use lucerna::scene::{Material, SceneFingerprint};
use lucerna::settings;
use lucerna::techniques::reference::Channel;

fn tiny() -> SparseSettings {
    settings!(SparseSettings {
        n_probes: 5,
        n_texels: 300,
        cluster_size: 16,
        n_rays: 64,
        order: 2,
        ..small()
    })
}

/// The same bake has the same bytes, also after it was read, and after it was killed between and within clusters and went on.
#[test]
fn bakes_are_repeatable_and_go_on() {
    let scene = lit_room();
    let world = upload(&scene);
    let whole = baked(&scene, &world, tiny());
    let bytes = whole.to_bytes();
    let again = baked(&scene, &world, tiny()).to_bytes();
    assert!(again == bytes, "baked again: {}", differing_bytes(&again, &bytes));
    let read = SparseBake::from_bytes(&bytes, true).unwrap();
    assert!(read == whole, "what was read differs from what was written");
    assert!(whole.plan.n_clusters() > 4, "{} clusters", whole.plan.n_clusters());
    // Stopped after two clusters, with a half one behind them.
    let mut bake = begun(&scene, &world, tiny(), None);
    let mut file = bake.to_bytes();
    let (meshes, fingerprint) = meshes_of(&scene);
    let of =
        SparseScene { seam: &world, meshes: &meshes, order: world.triangle_order(), fingerprint };
    let mut n = 0;
    let stopped = bake_sparse_probes(
        gpu(),
        &of,
        &mut bake,
        |cluster, _| {
            n += 1;
            let words = cluster.words();
            let kept = if n == 3 { words.len() / 2 } else { words.len() };
            file.extend(words[..kept].iter().flat_map(|word| word.to_le_bytes()));
            if n == 3 { Err(std::io::Error::other("no space left on device")) } else { Ok(()) }
        },
        |_| true,
    );
    assert!(
        matches!(&stopped, Err(SparseBakeError::Io(error)) if error.to_string().contains("no space")),
        "a full disk gives {stopped:?}"
    );
    let part = SparseBake::from_bytes(&file, false).unwrap();
    assert_eq!(part.clusters.len(), 2, "clusters of a file that ends within the third");
    assert!(
        matches!(part.check_complete(), Err(SparseError::Incomplete { .. })),
        "it is not complete"
    );
    let went_on = filled(&scene, &world, part).to_bytes();
    assert!(went_on == bytes, "gone on: {}", differing_bytes(&went_on, &bytes));
}

/// Parts of a divided bake, joined in any order, have the bytes of the whole: for 1, 3 and 17 parts. A part that is missing is named, and a part of
/// another bake is refused.
#[test]
fn parts_are_joined_to_the_same_bytes() {
    let scene = lit_room();
    let world = upload(&scene);
    let bytes = baked(&scene, &world, tiny()).to_bytes();
    let planned = begun(&scene, &world, tiny(), None).plan;
    for n in [1u32, 3, 17] {
        let mut parts: Vec<(String, SparseBake)> = (0..n)
            .map(|k| {
                // (Each machine plans for itself; of 17, the first and the last one do here.)
                let plan = match k {
                    3..16 => planned.clone(),
                    _ => begun(&scene, &world, tiny(), None).plan,
                };
                let part = filled(&scene, &world, SparseBake::begun(plan, [k, n]));
                assert!(part.missing().is_empty(), "part {k} of {n} is done");
                // Through a file, as parts travel.
                (format!("{k}"), SparseBake::from_bytes(&part.to_bytes(), true).unwrap())
            })
            .collect();
        parts.reverse();
        let merged = SparseBake::merge(parts.clone()).unwrap().to_bytes();
        assert!(merged == bytes, "{n} parts: {}", differing_bytes(&merged, &bytes));
        if n == 1 {
            continue;
        }
        let lost = parts.remove(1);
        let Err(SparseError::Incomplete { shards, .. }) = SparseBake::merge(parts.clone()) else {
            panic!("without part {}, the rest is merged", lost.0)
        };
        assert_eq!(shards, [format!("{}/{n}", lost.0)], "the part that is missing");
        let error = parts[0].1.check_complete().unwrap_err().to_string();
        assert!(error.contains("--shard"), "a part alone: {error}");
        let other = settings!(SparseSettings { seed: 1, ..tiny() });
        let other = SparseBake::begun(begun(&scene, &world, other, None).plan, [1, n]);
        parts.push(("other".into(), other));
        let error = SparseBake::merge(parts).unwrap_err();
        assert!(matches!(error, SparseError::OtherPart(ref name) if name == "other"), "{error}");
    }
    for ix in 0..40 {
        assert_eq!(
            (0..17).filter(|k| is_in_shard(ix, [*k, 17])).count(),
            1,
            "parts of cluster {ix}"
        );
    }
}

/// Files that are something else, of another version, truncated or damaged are refused, wherever a byte is wrong; and none of it panics.
#[test]
fn damaged_files_are_refused() {
    let scene = lit_room();
    let world = upload(&scene);
    let bake = baked(&scene, &world, tiny());
    let bytes = bake.to_bytes();
    let refused = |bytes: &[u8]| SparseBake::from_bytes(bytes, true).unwrap_err();
    assert!(matches!(refused(b""), SparseError::Foreign), "an empty file");
    assert!(matches!(refused(b"LUCPROBE and more of it"), SparseError::Foreign), "other probes");
    let mut newer = bytes.clone();
    newer[8] = 9;
    assert!(matches!(refused(&newer), SparseError::Version(9)), "version 9");
    for n in (8..bytes.len() - 1).step_by(bytes.len() / 97) {
        let error = refused(&bytes[..n]);
        // (At a cluster's end it is not truncated, but not complete.)
        assert!(!matches!(error, SparseError::Io(_)), "{n} bytes: {error}");
    }
    for at in (12..bytes.len()).step_by(bytes.len() / 211) {
        let mut other = bytes.clone();
        other[at] ^= 0x10;
        let found = SparseBake::from_bytes(&other, true);
        assert!(found.is_err(), "byte {at} is another one, and it is read all the same");
    }
    // Another program may write receivers where there is no chart, with the right checksums: these have light all the same.
    let mut odd = bake;
    let taken: Vec<u32> = odd.plan.receivers.iter().map(|of| of.texel).collect();
    let (width, height) = (odd.plan.size.x, odd.plan.size.y);
    let free = (0..height).flat_map(|y| (0..width).map(move |x| x | y << 16));
    odd.plan.receivers[0].texel = free.into_iter().find(|at| !taken.contains(at)).unwrap();
    let odd = SparseBake::from_bytes(&odd.to_bytes(), true).unwrap();
    let mut session = session(&world, &eye(), &odd);
    session.run(&world, 6);
    let light = session.mean(&world, 1, Channel::Indirect);
    assert!(light.is_finite() && light.min_element() > 0.0, "a receiver without a chart: {light}");
}

/// A bake does not fit a scene with other surfaces, or whose surfaces stand elsewhere; other lights and materials do not matter.
#[test]
fn bakes_fit_their_surfaces() {
    let scene = lit_room();
    let world = upload(&scene);
    let bake = begun(&scene, &world, tiny(), None);
    let of = |scene: &lucerna::scene::Scene| SceneFingerprint::of(scene, true, &|_| false);
    let mut other = scene.clone();
    other.lights.clear();
    other.materials[0] = Material::default();
    bake.check(&of(&other)).unwrap();
    other.instances[0].world_from_object.translation.x += 1.0;
    assert!(
        matches!(bake.check(&of(&other)), Err(SparseError::OtherScene)),
        "a wall that has moved"
    );
    let mut fewer = scene.clone();
    fewer.instances.pop();
    assert!(matches!(bake.check(&of(&fewer)), Err(SparseError::OtherScene)), "a wall that is gone");
}
