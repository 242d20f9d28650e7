// SPDX-License-Identifier: MIT OR Apache-2.0
//! Two triangles per quad: the even one at its corner, the odd one opposite.
#define_import_path lucerna::scene::triangles

#import lucerna::scene::types::TriangleCorners
#import own::quads::quads

fn n_triangles() -> u32 {
    return 2u * arrayLength(&quads);
}

fn triangle_corners(triangle_ix: u32) -> TriangleCorners {
    let quad = quads[triangle_ix / 2u];
    let along_u = quad.corner + quad.u;
    let along_v = quad.corner + quad.v;
    if triangle_ix % 2u == 0u {
        return TriangleCorners(quad.corner, along_u, along_v);
    }
    return TriangleCorners(along_u + quad.v, along_v, along_u);
}

fn triangle_moves(triangle_ix: u32) -> bool {
    return false;
}

fn triangle_is_masked(triangle_ix: u32) -> bool {
    return false;
}
