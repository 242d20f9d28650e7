// SPDX-License-Identifier: MIT OR Apache-2.0
//! The voxelizer against separating axes in f64, and what it promises of its structure.

use crate::harness::{Random, gpu, map, read, storage, submit};
use crate::rays::{random_triangles, soup};
use glam::{DVec3, UVec3, Vec3};
use lucerna::components::voxels::{
    BRICK, RasterMethod, RasterVoxelizer, Resolution, TriangleCounter, Triangles, VoxelCounts,
    VoxelError, VoxelGrid, Voxelizer, capacity_limit, grid_for_bounds, n_bricks,
};
use lucerna::gpu::{ComputeKernel, Dispatch};
use lucerna::gpu_scene::{GpuScene, GpuSceneOptions};
use lucerna::scene::{Instance, Scene};
use lucerna::seam::SceneSeam;

fn on_gpu(scene: &Scene) -> GpuScene {
    GpuScene::new(gpu(), scene, GpuSceneOptions::default()).unwrap()
}

fn grid(min: Vec3, max: Vec3, resolution: Resolution) -> VoxelGrid {
    let mut grid = grid_for_bounds(min, max, resolution, 6, None).unwrap();
    grid.capacity = grid.size.element_product().min(capacity_limit(grid.bricks, 6));
    grid
}

fn grid_of(triangles: &[[Vec3; 3]], resolution: Resolution) -> VoxelGrid {
    let corners = || triangles.iter().flatten().copied();
    let min = corners().reduce(Vec3::min).unwrap_or_default();
    grid(min, corners().reduce(Vec3::max).unwrap_or_default(), resolution)
}

/// Cells from a grid with corner 0 and cells of 1 m: world units are cells.
fn unit_grid(size: UVec3) -> VoxelGrid {
    VoxelGrid {
        origin: Vec3::ZERO,
        cell: 1.0,
        size,
        n_faces: 1,
        bricks: (size + BRICK - 1) / BRICK,
        capacity: size.element_product(),
    }
}

fn cell_ix(grid: &VoxelGrid, cell: UVec3) -> usize {
    ((cell.z * grid.size.y + cell.y) * grid.size.x + cell.x) as usize
}

/// Whether two convex polytopes overlap, borders included, by all axes that can separate a triangle
/// from a box: normals of both and products of edges. The box is `center` ± `half`.
fn meets(corners: &[DVec3; 3], center: DVec3, half: f64) -> bool {
    let edges = [corners[1] - corners[0], corners[2] - corners[1], corners[0] - corners[2]];
    let mut axes = vec![DVec3::X, DVec3::Y, DVec3::Z, edges[0].cross(edges[1])];
    for edge in edges {
        axes.extend(DVec3::AXES.map(|axis| axis.cross(edge)));
    }
    axes.into_iter().all(|axis| {
        let on = corners.map(|corner| axis.dot(corner));
        let (low, high) = (on[0].min(on[1]).min(on[2]), on[0].max(on[1]).max(on[2]));
        let (middle, reach) = (axis.dot(center), half * axis.abs().element_sum());
        low <= middle + reach && high >= middle - reach
    })
}

/// Triangles of each cell: for a box of half size ½, and for boxes as much smaller and larger as f32
/// may be wrong.
///
/// Corners are taken in cells as f32 gives them (a rounding each, 6e-8 of the coordinate; the same
/// on the GPU where division is right). From there the test's products of lengths up to the
/// triangle's extent L are wrong by about 4 roundings of L², over an axis of about length L; the
/// normal's by as much times how flat the triangle is.
struct Oracle {
    exact: Vec<u32>,
    low: Vec<u32>,
    high: Vec<u32>,
}

fn oracle(grid: &VoxelGrid, triangles: &[[Vec3; 3]]) -> Oracle {
    let n = grid.size.element_product() as usize;
    let mut out = Oracle { exact: vec![0; n], low: vec![0; n], high: vec![0; n] };
    for triangle in triangles {
        let corners = triangle.map(|p| ((p - grid.origin) / grid.cell).as_dvec3());
        let [a, b, c] = corners;
        let low = a.min(b).min(c);
        let high = a.max(b).max(c);
        let extent = (high - low).max_element();
        let area = (b - a).cross(c - a).length();
        let margin = 4.0 * 6e-8 * (1.0 + extent) * (1.0 + extent * extent / area);
        let last = grid.size.as_dvec3() - 1.0;
        if (high + 1.0).min_element() < 0.0 || (low - 1.0).cmpgt(last + 1.0).any() {
            continue;
        }
        let from = (low - 1.0).floor().clamp(DVec3::ZERO, last).as_uvec3();
        let to = (high + 1.0).floor().clamp(DVec3::ZERO, last).as_uvec3();
        for z in from.z..=to.z {
            for y in from.y..=to.y {
                for x in from.x..=to.x {
                    let cell = UVec3::new(x, y, z);
                    let center = cell.as_dvec3() + 0.5;
                    if !meets(&corners, center, 0.5 + margin) {
                        continue;
                    }
                    let ix = cell_ix(grid, cell);
                    out.high[ix] += 1;
                    out.exact[ix] += u32::from(meets(&corners, center, 0.5));
                    out.low[ix] += u32::from(meets(&corners, center, 0.5 - margin));
                }
            }
        }
    }
    out
}

fn gpu_counts(scene: &GpuScene, grid: VoxelGrid) -> Vec<u32> {
    let counter = TriangleCounter::new(gpu(), scene, grid).unwrap();
    submit(|recorder| counter.record(recorder, scene, Triangles::All).unwrap());
    let n = 4 * grid.size.element_product() as usize;
    bytemuck::cast_slice(&read(counter.counts())[..n]).to_vec()
}

/// What a voxelizer holds: cells in the order of slots, after checking the structure.
fn voxels(voxelizer: &Voxelizer) -> (Vec<UVec3>, VoxelCounts) {
    let grid = voxelizer.grid();
    let counts: VoxelCounts =
        bytemuck::pod_read_unaligned(&read(voxelizer.counts())[..size_of::<VoxelCounts>()]);
    let words: Vec<[u32; 2]> = bytemuck::pod_collect_to_vec(&read(voxelizer.structure()));
    let n = n_bricks(grid) as usize;
    assert!(
        counts.n_voxels <= grid.capacity,
        "{} voxels, expected at most the capacity {}",
        counts.n_voxels,
        grid.capacity
    );
    assert_eq!(
        counts.n_records,
        counts.n_voxels * grid.n_faces,
        "records of {} voxels with {} faces",
        counts.n_voxels,
        grid.n_faces
    );
    for (groups, n) in
        [(counts.voxel_groups, counts.n_voxels), (counts.record_groups, counts.n_records)]
    {
        let covered = u64::from(groups.x) * u64::from(groups.y) * 64;
        assert!(
            covered >= u64::from(n) && groups.max_element() <= 65535,
            "workgroups {groups} of 64 cover {covered}, expected at least {n} with at most 65535 an axis"
        );
        assert!(
            groups.y <= 1 || groups.x == 32768,
            "workgroups {groups}, expected one row, or rows of 32768"
        );
        assert!(
            covered < u64::from(n) + 64 * 32768,
            "workgroups {groups} of 64 cover {covered}, expected less than a row more than {n}"
        );
    }
    let mut cells = Vec::new();
    for (brick, &[occupied, first]) in words[..n].iter().enumerate() {
        assert_eq!(first as usize, cells.len(), "first slot of brick {brick}");
        let brick = brick as u32;
        let corner = UVec3::new(
            brick % grid.bricks.x,
            brick / grid.bricks.x % grid.bricks.y,
            brick / (grid.bricks.x * grid.bricks.y),
        ) * BRICK;
        for bit in (0..32).filter(|bit| occupied >> bit & 1 == 1) {
            let cell = corner + UVec3::new(bit % 4, bit / 4 % 4, bit / 16);
            assert!(
                cell.cmplt(grid.size).all(),
                "cell {cell} is marked, expected within the grid of {}",
                grid.size
            );
            let packed = cell.x | cell.y << 10 | cell.z << 20;
            assert_eq!(
                words[n + cells.len()],
                [packed, 0],
                "word of slot {}, cell {cell}",
                cells.len()
            );
            cells.push(cell);
        }
    }
    assert_eq!(
        cells.len(),
        counts.n_voxels as usize,
        "cells of the structure, expected as many as voxels are counted"
    );
    (cells, counts)
}

fn voxelized(scene: &GpuScene, grid: VoxelGrid, order: &[Triangles]) -> Voxelizer {
    let voxelizer = Voxelizer::new(gpu(), scene, grid).unwrap();
    for &triangles in order {
        submit(|recorder| voxelizer.record(recorder, scene, triangles).unwrap());
    }
    voxelizer
}

/// Counts and occupancy of a scene against the oracle; returns cells occupied, and how many
/// (triangle, cell) pairs f32 may decide either way.
fn check(triangles: &[[Vec3; 3]], grid: VoxelGrid) -> (usize, usize) {
    let scene = on_gpu(&soup(triangles));
    let expected = oracle(&grid, triangles);
    let found = gpu_counts(&scene, grid);
    let mut n_unequal = 0;
    let mut n_doubtful = 0;
    for (ix, &n) in found.iter().enumerate() {
        let (low, high) = (expected.low[ix], expected.high[ix]);
        n_doubtful += (high - low) as usize;
        n_unequal += usize::from(n != expected.exact[ix]);
        assert!(
            (low..=high).contains(&n),
            "cell {ix}: {n} triangles, expected {low} to {high}, {grid:?}"
        );
    }
    let (cells, counts) = voxels(&voxelized(&scene, grid, &[Triangles::All]));
    assert_eq!(counts.n_overflow, 0, "voxels that find no room in {grid:?}");
    let mut occupied = vec![false; found.len()];
    for cell in &cells {
        occupied[cell_ix(&grid, *cell)] = true;
    }
    // Two kernels, which a compiler may contract differently: they agree wherever f32 leaves no doubt.
    for (ix, &n) in found.iter().enumerate() {
        let is_in_doubt = expected.low[ix] == 0 && expected.high[ix] > 0;
        assert!(
            occupied[ix] == (n > 0) || is_in_doubt,
            "whether cell {ix}, which {n} triangles meet, is occupied: {}, {grid:?}",
            occupied[ix]
        );
    }
    println!(
        "{} triangles, {}: {} voxels, {n_doubtful} pairs in doubt, {n_unequal} counts differ from f64",
        triangles.len(),
        grid.size,
        cells.len()
    );
    (cells.len(), n_doubtful)
}

fn sphere(center: Vec3, radius: f32, levels: u32, out: &mut Vec<[Vec3; 3]>) {
    fn divide(t: [Vec3; 3], levels: u32, place: &dyn Fn(Vec3) -> Vec3, out: &mut Vec<[Vec3; 3]>) {
        let [a, b, c] = t;
        if levels == 0 {
            out.push(t.map(place));
            return;
        }
        let [ab, bc, ca] = [a + b, b + c, c + a].map(Vec3::normalize);
        for t in [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]] {
            divide(t, levels - 1, place, out);
        }
    }
    for k in 0..8 {
        let [x, y, z] = [0, 1, 2].map(|axis| if k >> axis & 1 == 0 { 1.0 } else { -1.0 });
        let [x, y, z] = [Vec3::X * x, Vec3::Y * y, Vec3::Z * z];
        divide([x, y, z], levels, &|p| center + radius * p, out);
    }
}

fn cube(min: Vec3, max: Vec3) -> Vec<[Vec3; 3]> {
    let corner = |k: usize| {
        Vec3::new([min.x, max.x][k & 1], [min.y, max.y][k >> 1 & 1], [min.z, max.z][k >> 2])
    };
    [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
        .iter()
        .flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]])
        .map(|t| t.map(corner))
        .collect()
}

/// 33 spheres in a box: 270 348 triangles.
fn room() -> Vec<[Vec3; 3]> {
    let mut triangles = cube(Vec3::new(-6.0, -3.0, -6.0), Vec3::new(6.0, 3.0, 6.0));
    for k in 0..33 {
        let (angle, distance) = (k as f32 * 2.4, 1.0 + 0.14 * k as f32);
        let radius = 0.4 + 0.015 * k as f32;
        let height = radius - 3.0 + 0.1 * k as f32;
        let center = Vec3::new(distance * angle.cos(), height, distance * angle.sin());
        sphere(center, radius, 5, &mut triangles);
    }
    triangles
}

/// At 128³ cells along the longest axis.
#[test]
fn voxelize_room_equals_f64() {
    let triangles = room();
    assert!(triangles.len() >= 260_000, "{} triangles, expected at least 260 000", triangles.len());
    let grid = grid_of(&triangles, Resolution::Size(UVec3::splat(128)));
    let (n, n_doubtful) = check(&triangles, grid);
    assert!(
        n > 40_000 && n_doubtful < 40,
        "{n} voxels and {n_doubtful} pairs in doubt, expected above 40 000 and below 40"
    );
}

/// Triangles of all sizes, in boxes of odd sizes that they reach out of.
#[test]
fn voxelize_soups_in_odd_boxes() {
    let sizes = [[1, 1, 1], [1, 7, 1], [5, 3, 9], [37, 2, 61], [64, 64, 64], [255, 9, 31]];
    for (k, size) in sizes.into_iter().enumerate() {
        for triangle_size in [0.3, 4.0, 30.0] {
            let triangles = random_triangles(300, triangle_size, 100 + k as u64);
            let size = UVec3::from_array(size);
            let grid = grid(Vec3::splat(-6.0), Vec3::splat(6.0), Resolution::Size(size));
            check(&triangles, grid);
        }
    }
}

/// The cells that a rasterising voxelizer marks.
fn rastered(scene: &GpuScene, grid: VoxelGrid, method: RasterMethod) -> Vec<bool> {
    let raster = RasterVoxelizer::new(gpu(), scene, grid, method).unwrap();
    // Twice: the second time begins anew.
    for _ in 0..2 {
        submit(|recorder| raster.record(recorder, scene).unwrap());
    }
    let words: Vec<u32> = bytemuck::pod_collect_to_vec(&read(raster.bits()));
    let mut marked = vec![false; grid.size.element_product() as usize];
    for (brick, word) in (0..n_bricks(&grid)).zip(words) {
        let at = UVec3::new(
            brick % grid.bricks.x,
            brick / grid.bricks.x % grid.bricks.y,
            brick / (grid.bricks.x * grid.bricks.y),
        );
        for bit in (0..32).filter(|bit| word >> bit & 1 == 1) {
            let cell = at * BRICK + UVec3::new(bit % 4, bit / 4 % 4, bit / 16);
            assert!(
                cell.cmplt(grid.size).all(),
                "cell {cell} is marked, expected within the grid of {}",
                grid.size
            );
            marked[cell_ix(&grid, cell)] = true;
        }
    }
    marked
}

/// Cells that the lines through the middles of columns along these axes meet a triangle in: surely, which is at least 0.01
/// cells (a rasteriser's snapping is 1/256) away from an edge of the triangle and from the next cell.
fn crossed(
    grid: &VoxelGrid,
    triangles: &[[Vec3; 3]],
    axes: impl Fn(DVec3) -> Vec<usize>,
) -> Vec<bool> {
    const MARGIN: f64 = 0.01;
    let mut out = vec![false; grid.size.element_product() as usize];
    for triangle in triangles {
        let [a, b, c] = triangle.map(|p| ((p - grid.origin) / grid.cell).as_dvec3());
        let normal = (b - a).cross(c - a);
        for axis in axes(normal) {
            let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
            let flat = |p: DVec3| glam::DVec2::new(p[u], p[v]);
            let area = (flat(b) - flat(a)).perp_dot(flat(c) - flat(a));
            if area.abs() < 1e-3 {
                continue;
            }
            for x in 0..grid.size[u] {
                for y in 0..grid.size[v] {
                    let at = glam::DVec2::new(f64::from(x), f64::from(y)) + 0.5;
                    let edges = [(a, b), (b, c), (c, a)];
                    let is_inside = edges.iter().all(|&(from, to)| {
                        let edge = flat(to) - flat(from);
                        edge.perp_dot(at - flat(from)) * area.signum() > MARGIN * edge.length()
                    });
                    let off = at - flat(a);
                    let depth = a[axis] - (normal[u] * off.x + normal[v] * off.y) / normal[axis];
                    // Snapping moves the point by up to 1/256 on a plane with this slope.
                    let slope = (normal[u].abs() + normal[v].abs()) / normal[axis].abs();
                    let reach = MARGIN * (1.0 + slope);
                    if !is_inside || (depth - reach).floor() != (depth + reach).floor() {
                        continue;
                    }
                    if depth > 0.0 && depth < f64::from(grid.size[axis]) {
                        let mut cell = UVec3::ZERO;
                        (cell[u], cell[v], cell[axis]) = (x, y, depth as u32);
                        out[cell_ix(grid, cell)] = true;
                    }
                }
            }
        }
    }
    out
}

/// The rasterising voxelizers, in boxes whose sides are and are not multiples of a brick's: rectangles mark what the exact
/// one marks; pictures along axes mark the cells that columns' middles meet; nothing marks a cell that no triangle is near.
#[test]
fn rasterising_voxelizers_mark_what_they_say() {
    let mut n_tested = 0;
    for (k, size) in [[8, 8, 4], [7, 13, 9], [33, 20, 31]].into_iter().enumerate() {
        for triangle_size in [3.0, 8.0] {
            let triangles = random_triangles(300, triangle_size, 300 + k as u64);
            let size = UVec3::from_array(size);
            let grid = grid(Vec3::splat(-6.0), Vec3::splat(6.0), Resolution::Size(size));
            let scene = on_gpu(&soup(&triangles));
            let expected = oracle(&grid, &triangles);
            let what = format!("{size}, triangles of {triangle_size} m");
            let marked = rastered(&scene, grid, RasterMethod::BoundingQuad);
            for (ix, &is_marked) in marked.iter().enumerate() {
                let (low, high) = (expected.low[ix] > 0, expected.high[ix] > 0);
                assert!(
                    is_marked >= low && is_marked <= high,
                    "rectangles, {what}: cell {ix} is marked: {is_marked}, expected from {low} to {high}"
                );
            }
            for method in [RasterMethod::ThreeAxes, RasterMethod::DominantAxis] {
                let axes = |normal: DVec3| match method {
                    RasterMethod::ThreeAxes => vec![0, 1, 2],
                    _ => vec![normal.abs().max_position()],
                };
                let marked = rastered(&scene, grid, method);
                let surely = crossed(&grid, &triangles, axes);
                let n_sure = surely.iter().filter(|&&is| is).count();
                println!("{method:?}, {what}: {n_sure} cells are surely met");
                n_tested += n_sure;
                let n_marked = marked.iter().filter(|&&is| is).count();
                let mut n_beside = 0;
                for ix in 0..marked.len() {
                    assert!(
                        marked[ix] || !surely[ix],
                        "{method:?}, {what}: cell {ix} is not marked, expected so: a column's middle surely meets a triangle in it"
                    );
                    n_beside += usize::from(marked[ix] && expected.high[ix] == 0);
                }
                // Snapping may carry a fragment at an edge into the next cell.
                assert!(
                    50 * n_beside <= n_marked,
                    "{method:?}, {what}: {n_beside} of {n_marked} marked cells are not met by a triangle, expected at most 2 %"
                );
            }
        }
    }
    assert!(n_tested > 1000, "{n_tested} cells are surely met, expected above 1000");
}

/// The rule of borders: what touches a cell meets it. All numbers are small multiples of ½, where
/// the test is exact, and so is the expectation.
#[test]
fn voxelize_on_borders() {
    let size = UVec3::new(11, 7, 9);
    let grid = unit_grid(size);
    let mut random = Random(5);
    let triangles: Vec<[Vec3; 3]> = (0..3000)
        .map(|k| {
            let mut next = |n: u64| ((random.bits() % (4 * n)) as f32 - n as f32) * 0.5;
            let mut t: [Vec3; 3] = [(); 3].map(|()| Vec3::new(next(11), next(7), next(9)));
            if k % 2 == 0 {
                // In a plane of borders.
                let at = t[0][k % 3].floor();
                t.iter_mut().for_each(|p| p[k % 3] = at);
            }
            t
        })
        .filter(|[a, b, c]| (b - a).cross(c - a) != Vec3::ZERO)
        .collect();
    let found = gpu_counts(&on_gpu(&soup(&triangles)), grid);
    let expected = oracle(&grid, &triangles).exact;
    let first = (0..found.len()).find(|&ix| found[ix] != expected[ix]);
    assert!(
        found == expected,
        "triangles on borders: the first cell whose count differs is {first:?}: {:?}, expected {:?}",
        first.map(|ix| found[ix]),
        first.map(|ix| expected[ix])
    );
    // A wall between cells 4 and 5 occupies both.
    let wall = [[Vec3::new(5.0, 1.25, 1.25), Vec3::new(5.0, 2.75, 1.5), Vec3::new(5.0, 1.5, 2.75)]];
    let voxelizer = voxelized(&on_gpu(&soup(&wall)), grid, &[Triangles::All]);
    let cells = voxels(&voxelizer).0;
    assert!(
        cells.iter().all(|cell| cell.x == 4 || cell.x == 5) && cells.len() == 8,
        "cells of a wall between x = 4 and 5 are {cells:?}, expected 8 at either"
    );
}

#[test]
fn voxelize_slivers_and_giants() {
    let mut random = Random(9);
    let mut triangles = Vec::new();
    for _ in 0..400 {
        let mut point = |size: f32| -> Vec3 {
            Vec3::from_array(std::array::from_fn(|_| random.range(-size, size)))
        };
        let (a, b): (Vec3, Vec3) = (point(6.0), point(6.0));
        // Nearly on the line between.
        triangles.push([a, b, a.lerp(b, 0.4) + point(1e-4)]);
        // Far larger than the grid.
        triangles.push([point(2000.0), point(2000.0), point(2000.0)]);
    }
    let grid = grid(Vec3::splat(-5.0), Vec3::splat(5.0), Resolution::Longest(48));
    check(&triangles, grid);
}

#[test]
fn voxelize_nothing_and_outside() {
    let nothing = on_gpu(&Scene::default());
    let grid = grid_of(&[], Resolution::Longest(16));
    let (cells, counts) = voxels(&voxelized(&nothing, grid, &[Triangles::All]));
    assert!(
        cells.is_empty() && counts.n_overflow == 0,
        "an empty scene has {} voxels and {} that find no room, expected none",
        cells.len(),
        counts.n_overflow
    );
    assert_eq!(
        (counts.voxel_groups.x, counts.record_groups.x),
        (0, 0),
        "workgroups of voxels and records of an empty scene"
    );

    let far = on_gpu(&soup(&[
        [Vec3::splat(50.0), Vec3::new(60.0, 50.0, 50.0), Vec3::new(50.0, 60.0, 50.0)],
        [Vec3::splat(1e12), Vec3::splat(-1e12), Vec3::new(1e12, 0.0, 1e12)],
    ]));
    let (cells, _) = voxels(&voxelized(&far, unit_grid(UVec3::splat(8)), &[Triangles::All]));
    assert!(cells.is_empty(), "a scene outside the grid has {} voxels, expected none", cells.len());
}

/// With too little room the first voxels stay, and the others are counted.
#[test]
fn voxelize_overflow() {
    let triangles = random_triangles(500, 2.0, 77);
    let scene = on_gpu(&soup(&triangles));
    let mut grid = grid_of(&triangles, Resolution::Longest(40));
    let all = voxels(&voxelized(&scene, grid, &[Triangles::All])).0;
    for capacity in [1, 31, 1000, all.len() as u32 - 1, all.len() as u32] {
        grid.capacity = capacity;
        let (some, counts) = voxels(&voxelized(&scene, grid, &[Triangles::All]));
        assert_eq!(
            some,
            all[..capacity as usize],
            "capacity {capacity}: voxels, expected the first of all"
        );
        assert_eq!(
            counts.n_overflow,
            all.len() as u32 - capacity,
            "capacity {capacity}: voxels that find no room, of {}",
            all.len()
        );
    }
}

/// Static and moving triangles apart, in any order and again, give the voxels of all.
#[test]
fn voxelize_moving_over_static() {
    let triangles = random_triangles(400, 3.0, 31);
    let mut scene = soup(&triangles[..250]);
    let moving = soup(&triangles[250..]);
    scene.meshes.extend(moving.meshes);
    scene.instances.push(Instance { mesh: 1, ..scene.instances[0].clone() });
    let options = GpuSceneOptions::default();
    let on_gpu = GpuScene::with_moving(gpu(), &scene, options, &|ix| ix == 1).unwrap();
    let grid = grid_of(&triangles, Resolution::Longest(50));
    let bytes = |order: &[Triangles]| {
        let voxelizer = voxelized(&on_gpu, grid, order);
        let cells = voxels(&voxelizer).0;
        (cells, read(voxelizer.counts()))
    };
    use Triangles::{All, Moving, Static};
    let all = bytes(&[All]);
    for order in [
        &[Static, Moving][..],
        &[Moving, Static],
        &[Static, Moving, Moving],
        &[All, Static, Moving],
    ] {
        let found = bytes(order);
        assert!(
            found == all,
            "{order:?}: {} voxels with counts {:?}, expected the {} of all, in their order, with {:?}",
            found.0.len(),
            found.1,
            all.0.len(),
            all.1
        );
    }
    let alone = bytes(&[Static]).0;
    assert!(
        alone.len() < all.0.len(),
        "static triangles alone have {} voxels, expected below the {} of all",
        alone.len(),
        all.0.len()
    );
    let scene = GpuScene::new(gpu(), &soup(&triangles[..250]), options).unwrap();
    let expected = voxels(&voxelized(&scene, grid, &[All])).0;
    assert!(
        alone == expected,
        "static triangles alone have {} voxels, expected the {} of a scene of them, in their order",
        alone.len(),
        expected.len()
    );
}

#[test]
fn grids_have_margins_and_limits() {
    let mut random = Random(3);
    for k in 0..2000 {
        let min = random.direction() * 10f32.powf(random.range(-2.0, 2.0));
        let mut extent = random.direction().abs() * 10f32.powf(random.range(-1.0, 3.0));
        if k % 5 == 0 {
            extent[k % 3] = 0.0;
        }
        let mut side = || 6 + (random.bits() % 251) as u32;
        let resolution = match k % 2 {
            0 => Resolution::Longest(side()),
            _ => Resolution::Size(UVec3::new(side(), side(), side())),
        };
        let grid = grid(min, min + extent, resolution);
        let (low, high) = (
            (min - grid.origin) / grid.cell,
            grid.size.as_vec3() - (min + extent - grid.origin) / grid.cell,
        );
        // 1.5 cells less the offset; f32 at 256 cells is good to 1e-2 here.
        assert!(
            low.min_element() > 1.2 && high.min_element() > 1.2,
            "margins of {grid:?} are {low} and {high} cells, expected above 1.2"
        );
        let limit = capacity_limit(grid.bricks, 6);
        assert!(
            grid.capacity <= limit,
            "the capacity is {}, expected at most {limit}",
            grid.capacity
        );
        match resolution {
            Resolution::Longest(n) => assert!(
                grid.size.max_element() == n,
                "the longest side is {}, expected {n}: {grid:?}",
                grid.size.max_element()
            ),
            Resolution::Size(size) => {
                assert_eq!(grid.size, size, "size of the grid, expected the one asked for")
            }
        }
    }
    let box_of = |min: f32, max: f32, n, faces, capacity| {
        grid_for_bounds(Vec3::splat(min), Vec3::splat(max), Resolution::Longest(n), faces, capacity)
    };
    for n in [1, 2, 5] {
        assert_eq!(
            box_of(0.0, 1.0, n, 6, None).unwrap().size,
            UVec3::splat(n),
            "size of a grid of {n} cells along the longest side"
        );
    }
    let made = box_of(0.0, 1.0, 0, 6, None);
    assert!(
        matches!(made, Err(VoxelError::Size(_))),
        "box_of(0.0, 1.0, 0, 6, None) gives {made:?}, expected Size"
    );
    let made = box_of(0.0, 1.0, 257, 6, None);
    assert!(
        matches!(made, Err(VoxelError::Size(_))),
        "box_of(0.0, 1.0, 257, 6, None) gives {made:?}, expected Size"
    );
    let made = box_of(0.0, 1.0, 16, 2, None);
    assert!(
        matches!(made, Err(VoxelError::Faces(2))),
        "box_of(0.0, 1.0, 16, 2, None) gives {made:?}, expected Faces"
    );
    let made = box_of(1.0, 0.0, 16, 1, None);
    assert!(
        matches!(made, Err(VoxelError::Bounds { .. })),
        "box_of(1.0, 0.0, 16, 1, None) gives {made:?}, expected Bounds"
    );
    let made = box_of(f32::NAN, 0.0, 16, 1, None);
    assert!(
        matches!(made, Err(VoxelError::Bounds { .. })),
        "box_of(f32::NAN, 0.0, 16, 1, None) gives {made:?}, expected Bounds"
    );
    let made = box_of(1e6, 1e6 + 1.0, 256, 1, None);
    assert!(
        matches!(made, Err(VoxelError::TooFine { .. })),
        "box_of(1e6, 1e6 + 1.0, 256, 1, None) gives {made:?}, expected TooFine"
    );
    let made = box_of(0.0, 1.0, 16, 6, Some(0));
    assert!(
        matches!(made, Err(VoxelError::Capacity { .. })),
        "box_of(0.0, 1.0, 16, 6, Some(0)) gives {made:?}, expected Capacity"
    );
    let error = box_of(0.0, 1.0, 256, 6, Some(2_000_000)).unwrap_err();
    assert!(
        error.to_string().contains("128 MiB"),
        "2 000 000 voxels: the error is `{error}`, expected to contain `128 MiB`"
    );
}

/// The one size that Rust keeps by hand.
#[test]
fn bricks_are_the_shaders() {
    let bricks: Vec<UVec3> = map(
        "#import lucerna::components::voxels::bricks::BRICK
        struct Input { nothing: u32 }
        struct Output { x: u32, y: u32, z: u32 }
        fn map(i: Input) -> Output { return Output(BRICK.x, BRICK.y, BRICK.z); }",
        &[0u32],
    );
    assert_eq!(bricks, [BRICK], "size of a brick in the shader, expected Rust's");
}

/// `voxels/work_groups` lays out the counted pieces of work as dispatches: ⌈n/64⌉ workgroups in rows of 32 768.
#[test]
fn work_is_dispatched_in_rows() {
    let corner = |k: u32| Vec3::new(k as f32, (k % 3) as f32, (k % 7) as f32);
    for n_triangles in [1u32, 5] {
        let triangles: Vec<_> =
            (0..n_triangles).map(|k| [corner(k), corner(k + 1), corner(k + 9)]).collect();
        let scene = on_gpu(&soup(&triangles));
        let kernel =
            ComputeKernel::new(gpu(), scene.shaders(), Some(scene.group()), "voxels/work_groups");
        for n in [0u32, 1, 63, 64, 65, 64 * 32_767 + 1, 64 * 32_768, 64 * 32_768 + 1, 300_000_000] {
            // What the other words hold does not matter.
            let mut work = vec![77u32; n_triangles as usize + 9];
            work[n_triangles as usize] = n;
            let work = storage(bytemuck::cast_slice(&work));
            let groups = storage(bytemuck::cast_slice(&[5u32, 5, 5, 5, 0xabcd, 0xabcd]));
            submit(|recorder| {
                kernel
                    .call(&mut recorder.compute("test"))
                    .scene(scene.group())
                    .bind("work", &work)
                    .bind("groups", &groups)
                    .dispatch(Dispatch::Rows(1));
            });
            let found: Vec<u32> = bytemuck::pod_collect_to_vec(&read(&groups));
            let n_groups = n.div_ceil(64);
            let expected = [n_groups.min(32_768), n_groups.div_ceil(32_768), 1, n, 0xabcd, 0xabcd];
            assert_eq!(
                found, expected,
                "groups along x, y, z, pieces, two guards; {n} pieces of {n_triangles} triangles"
            );
        }
    }
}

#[repr(C)]
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
struct ColumnsFound {
    first: UVec3,
    n: u32,
    end: UVec3,
    axis: u32,
    /// First cell and end of a column.
    column: [u32; 4],
    n_work: [u32; 4],
}

/// A triangle's columns: the cells of its box, borders included, within the grid; along the axis where its normal is
/// longest; in pieces of 16. In each column the cells that the triangle meets, by separating axes in f64, are there, and few
/// others: the slope is at most 1 along either side, so at most 2 that it meets, 1 below and above, and what rounding asks
/// for. Triangles beyond the grid, or farther than 1.6e7 cells from its corner, have none.
#[test]
fn columns_hold_what_a_triangle_meets() {
    let mut random = Random(110);
    let size = UVec3::new(19, 12, 23);
    let mut triangles: Vec<[Vec3; 3]> = (0..4000)
        .map(|k| {
            let place = |random: &mut Random| {
                Vec3::from_array(std::array::from_fn(|axis| {
                    random.range(-6.0, size[axis] as f32 + 6.0)
                }))
            };
            let middle = place(&mut random);
            match k % 4 {
                // Across an axis, on a border or not.
                0 => {
                    let axis = k / 4 % 3;
                    let mut corners = [(); 3].map(|()| place(&mut random));
                    corners.iter_mut().for_each(|corner| corner[axis] = middle[axis].round());
                    corners
                }
                1 => [(); 3].map(|()| place(&mut random)),
                _ => [(); 3].map(|()| middle + random.range(0.1, 5.0) * random.direction()),
            }
        })
        .collect();
    // Far away along each axis, on either side of the limit.
    for axis in 0..3 {
        for far in [1.55e7, 1.65e7, -1.55e7, -1.65e7] {
            let mut corners = [Vec3::splat(3.0), Vec3::splat(5.0), Vec3::new(4.0, 6.0, 3.0)];
            corners[1][axis] = far;
            triangles.push(corners);
        }
    }
    let inputs: Vec<[glam::Vec4; 3]> = triangles
        .iter()
        .map(|t| [t[0].extend(random.unit()), t[1].extend(0.0), t[2].extend(0.0)])
        .collect();
    let found: Vec<ColumnsFound> = map(
        "#import lucerna::components::voxels::grid::VoxelGrid
         #import lucerna::components::voxels::work::{cells_of_column, columns_of_triangle, grid_triangle, n_work_of_columns}
         struct Input { a: vec4<f32>, b: vec4<f32>, c: vec4<f32> }
         struct Output { first: vec3<u32>, n: u32, end: vec3<u32>, axis: u32, column: vec4<u32>, n_work: vec4<u32> }
         fn map(x: Input) -> Output {
             // Cells of 1 m from the corner 0.
             let grid = VoxelGrid(vec3<f32>(0.0), 1.0, vec3<u32>(19u, 12u, 23u), 1u, vec3<u32>(5u, 3u, 12u), 1u);
             let triangle = grid_triangle(grid, x.a.xyz, x.b.xyz, x.c.xyz);
             let found = columns_of_triangle(grid, triangle);
             var column = vec4<u32>(0u);
             if found.n > 0u {
                 column = cells_of_column(triangle, found, min(u32(x.a.w * f32(found.n)), found.n - 1u));
             }
             return Output(found.first, found.n, found.end, found.axis, column, vec4<u32>(n_work_of_columns(found)));
         }",
        &inputs,
    );
    let (mut n_columns, mut n_held, mut n_met) = (0, 0, 0);
    for (triangle, (input, found)) in triangles.iter().zip(inputs.iter().zip(&found)) {
        let what = format!("triangle {triangle:?}: {found:?}");
        let corners = triangle.map(|p| p.as_dvec3());
        let low = corners[0].min(corners[1]).min(corners[2]);
        let high = corners[0].max(corners[1]).max(corners[2]);
        let too_far = low.min_element() < -1.6e7 || high.max_element() > 1.6e7;
        if too_far || low.cmpgt(size.as_dvec3()).any() || high.cmplt(DVec3::ZERO).any() {
            assert_eq!(found.n, 0, "columns of a triangle that is too far away; {what}");
            continue;
        }
        // Cell k is [k, k + 1], borders included.
        let last = size.as_dvec3() - 1.0;
        let first = (low.ceil() - 1.0).clamp(DVec3::ZERO, last).as_uvec3();
        let end = high.floor().clamp(DVec3::ZERO, last).as_uvec3() + 1;
        assert_eq!((found.first, found.end), (first, end), "cells of the triangle's box; {what}");
        let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
        let axis = found.axis as usize;
        let longest = normal.abs().max_element();
        assert!(normal[axis].abs() >= longest * (1.0 - 1e-4), "axis of {normal}; {what}");
        let sides = [(axis + 1) % 3, (axis + 2) % 3];
        let cells = end - first;
        let n = cells[sides[0]] * cells[sides[1]];
        assert_eq!(
            (found.n, found.n_work[0]),
            (n, n.div_ceil(16)),
            "columns and pieces of work; {what}"
        );
        if high.max_element() > 1e6 || low.min_element() < -1e6 {
            continue;
        }
        // The column that was asked for, counted along the first of the sides in order.
        let ordered = [sides[0].min(sides[1]), sides[0].max(sides[1])];
        let ix = ((input[0].w * n as f32) as u32).min(n - 1);
        let mut cell = first;
        cell[ordered[0]] += ix % cells[ordered[0]];
        cell[ordered[1]] += ix / cells[ordered[0]];
        for side in sides {
            assert_eq!(found.column[side], cell[side], "place of column {ix}; {what}");
        }
        let (from, to) = (found.column[axis], found.column[3]);
        let mut met = 0;
        for k in first[axis]..end[axis] {
            cell[axis] = k;
            if meets(&corners, cell.as_dvec3() + 0.5, 0.5) {
                met += 1;
                assert!(
                    (from..to).contains(&k),
                    "cell {cell}, which the triangle meets, is not in {from}..{to}; {what}"
                );
            }
        }
        let edges = [0, 1, 2].map(|k| (corners[(k + 1) % 3] - corners[k]).length_squared());
        let longest_edge = edges[0].max(edges[1]).max(edges[2]);
        if longest > 0.01 * longest_edge {
            n_columns += 1;
            n_held += to - from;
            n_met += met;
            assert!(
                to - from <= 6,
                "cells of column {ix}: {from}..{to}, expected at most 6; {what}"
            );
        }
    }
    println!("{n_columns} columns hold {n_held} cells, of which {n_met} are met");
    assert!(n_columns > 1000 && n_met > 800, "{n_columns} columns, {n_met} cells met");
}
