//! Bodies: analytic shapes, grids of distances, triangle meshes.

use super::desc;
use super::guard::{entry, guard};
use super::handle::Table;
use super::input::{self, LARGEST_COUNT};
use super::output;
use super::status::toile_status;
use super::types::{toile_body, toile_sdf_grid_desc};
use crate::body::Body;
use crate::error::{Error, Result};
use crate::math::Vec3;
use std::ffi::c_char;
use std::path::Path;
use std::ptr;

pub(super) static BODIES: Table<Body> = Table::new(0x72, "body");

/// Most vertices or triangles of a body.
const LARGEST_MESH: usize = 1 << 24;

unsafe fn give(body: Body, out: *mut *mut toile_body) -> Result<()> {
    let handle = ptr::without_provenance_mut(BODIES.insert(body)?);
    // SAFETY: checked by the caller.
    unsafe { output::put(out, handle) };
    Ok(())
}

/// A sphere around its origin, radius [m]. Free it with toile_body_free; simulations that use a body
/// keep what they need.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn toile_body_sphere(radius: f64, out: *mut *mut toile_body) -> toile_status {
    entry!({
        input::target(out, "out")?;
        give(Body::sphere(input::positive(radius, "radius")?)?, out)
    })
}

/// A capsule along its y axis: the points within `radius` [m] of the segment from -half_length to
/// half_length [m].
#[unsafe(no_mangle)]
pub unsafe extern "C" fn toile_body_capsule(
    half_length: f64,
    radius: f64,
    out: *mut *mut toile_body,
) -> toile_status {
    entry!({
        input::target(out, "out")?;
        let half_length = input::not_negative(half_length, "half_length")?;
        let radius = input::positive(radius, "radius")?;
        give(Body::capsule(half_length, radius)?, out)
    })
}

/// The half space where normal . x <= offset; the normal has any length but 0, and offset is in
/// metres when it has length 1.
///
/// cbindgen:ptrs-as-arrays=[[normal; 3]]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn toile_body_plane(
    normal: *const f64,
    offset: f64,
    out: *mut *mut toile_body,
) -> toile_status {
    entry!({
        input::target(out, "out")?;
        let normal = input::numbers::<3>(normal, "normal")?;
        let offset = input::finite(offset, "offset")?;
        give(Body::plane(normal, offset)?, out)
    })
}

/// A body from signed distances on a regular grid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn toile_body_grid(
    desc: *const toile_sdf_grid_desc,
    out: *mut *mut toile_body,
) -> toile_status {
    entry!({
        input::target(out, "out")?;
        let desc = desc::read(desc)?;
        input::reserved(desc.reserved)?;
        let product = desc
            .counts
            .iter()
            .try_fold(1_usize, |p, &n| p.checked_mul(n as usize));
        let [i, j, k] = desc.counts;
        if desc.counts.iter().any(|&n| n < 2) {
            return Err(Error::argument(format!(
                "counts = {i} x {j} x {k}: at least 2 nodes are needed along each axis"
            )));
        }
        match product {
            Some(n) if n <= LARGEST_COUNT => input::same_count(desc.value_count, n, "values")?,
            _ => {
                return Err(Error::limit(format!(
                    "{i} x {j} x {k} nodes are above the limit of {LARGEST_COUNT}"
                )));
            }
        }
        let cell_size = input::positive(desc.cell_size, "cell_size")?;
        input::finite_all(&desc.origin, "origin")?;
        let values = input::array(desc.values, desc.value_count, LARGEST_COUNT, "values")?;
        input::finite_all(values, "values")?;
        let counts = desc.counts.map(|n| n as usize);
        give(Body::grid(counts, desc.origin, cell_size, values)?, out)
    })
}

/// A body from a closed triangle mesh: positions [m], shape [vertex_count, 3]; triangles, shape
/// [triangle_count, 3], counter-clockwise seen from outside. The field is sampled every `cell_size`
/// [m] near the surface, at most a quarter of the body's least extent; 0 chooses. TOILE_E_GEOMETRY names what is
/// wrong with the mesh.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn toile_body_mesh(
    positions: *const f64,
    vertex_count: usize,
    triangles: *const u32,
    triangle_count: usize,
    cell_size: f64,
    out: *mut *mut toile_body,
) -> toile_status {
    entry!({
        input::target(out, "out")?;
        let cell_size = input::not_negative(cell_size, "cell_size")?;
        let positions = input::points::<3>(positions, vertex_count, LARGEST_MESH, "positions")?;
        let triangles = input::array(
            triangles.cast::<[u32; 3]>(),
            triangle_count,
            LARGEST_MESH,
            "triangles",
        )?;
        for (t, triangle) in triangles.iter().enumerate() {
            if let Some(v) = triangle.iter().find(|&&v| v as usize >= vertex_count) {
                return Err(Error::argument(format!(
                    "triangle {t} uses vertex {v} of {vertex_count}"
                )));
            }
        }
        give(Body::mesh(&positions, triangles, cell_size)?, out)
    })
}

/// A body from a Wavefront OBJ file (path UTF-8, ends with NUL). `scale` multiplies its coordinates
/// into metres: 0.01 for a file in centimetres. `cell_size` as in toile_body_mesh.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn toile_body_obj(
    path: *const c_char,
    scale: f64,
    cell_size: f64,
    out: *mut *mut toile_body,
) -> toile_status {
    entry!({
        input::target(out, "out")?;
        let path = input::name(path, "path")?;
        let scale = input::positive(scale, "scale")?;
        let cell_size = input::not_negative(cell_size, "cell_size")?;
        give(Body::obj(Path::new(path), scale, cell_size)?, out)
    })
}

/// Signed distance [m] of a point [m] in the body's own frame, and its gradient; either of
/// `out_distance` and `out_gradient` may be NULL. Far from the surface the distance is a bound with
/// the right sign.
///
/// cbindgen:ptrs-as-arrays=[[point; 3], [out_gradient; 3]]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn toile_body_distance(
    body: *const toile_body,
    point: *const f64,
    out_distance: *mut f64,
    out_gradient: *mut f64,
) -> toile_status {
    entry!({
        let body = BODIES.get(body.addr())?;
        let point = Vec3::from(input::numbers::<3>(point, "point")?);
        let at = body.read(|b| Ok(b.distance(&point)))?;
        if !out_distance.is_null() {
            output::put(out_distance, at.value);
        }
        if !out_gradient.is_null() {
            let gradient: [f64; 3] = at.gradient.into();
            output::put(out_gradient.cast(), gradient);
        }
        Ok(())
    })
}

/// Frees a body; NULL is allowed. Simulations that use it are not concerned.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn toile_body_free(body: *mut toile_body) {
    if !body.is_null() {
        guard(|| BODIES.remove(body.addr()));
    }
}
