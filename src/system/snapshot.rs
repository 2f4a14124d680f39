//! Snapshots: the State as bytes, with magic, version, the garment's fingerprint and a checksum.
//!
//! ```text
//! "TOILESNP" | version u32 | fingerprint u64 | length u64 | payload | checksum u64   (little endian)
//! ```

use super::state::State;
use crate::cloth::Cloth;
use crate::error::{Error, Result};
use crate::math::Vec3;
use crate::math::hash::Hash;

const MAGIC: &[u8; 8] = b"TOILESNP";
const VERSION: u32 = 2;
const HEADER: usize = 8 + 4 + 8 + 8;

/// A number that two systems share only if their meshes and fabrics are the same.
pub fn fingerprint(cloth: &Cloth) -> u64 {
    let mut hash = Hash::default();
    for p in &cloth.mesh.uv {
        hash.add(&p.x.to_bits().to_le_bytes());
        hash.add(&p.y.to_bits().to_le_bytes());
    }
    for v in cloth.mesh.triangles.iter().flatten() {
        hash.add(&v.to_le_bytes());
    }
    for link in cloth.mesh.seams.iter().flat_map(|s| &s.links) {
        hash.add(&link.vertex.to_le_bytes());
        hash.add(&link.edge[0].to_le_bytes());
        hash.add(&link.t.to_bits().to_le_bytes());
    }
    for f in &cloth.fabrics {
        hash.add(format!("{f:?}").as_bytes());
    }
    hash.value()
}

/// Bytes of a state.
pub fn write(state: &State, fingerprint: u64) -> Result<Vec<u8>> {
    let payload = postcard::to_stdvec(state).map_err(|e| Error::state(format!("snapshot: {e}")))?;
    let mut bytes = Vec::with_capacity(HEADER + payload.len() + 8);
    bytes.extend_from_slice(MAGIC);
    bytes.extend_from_slice(&VERSION.to_le_bytes());
    bytes.extend_from_slice(&fingerprint.to_le_bytes());
    bytes.extend_from_slice(&(payload.len() as u64).to_le_bytes());
    bytes.extend_from_slice(&payload);
    let mut hash = Hash::default();
    hash.add(&bytes);
    bytes.extend_from_slice(&hash.value().to_le_bytes());
    Ok(bytes)
}

/// The state in `bytes`; it must fit `like`, a state of the simulation that restores it.
pub fn read(bytes: &[u8], fingerprint: u64, like: &State) -> Result<State> {
    let bad = |what: String| Error::parse(format!("snapshot: {what}"));
    if bytes.len() < HEADER + 8 || &bytes[..8] != MAGIC {
        return Err(bad(format!(
            "{} bytes are not a snapshot of this library",
            bytes.len()
        )));
    }
    let number = |from: usize| {
        let mut b = [0_u8; 8];
        b.copy_from_slice(&bytes[from..from + 8]);
        u64::from_le_bytes(b)
    };
    let version = number(8) as u32;
    if version != VERSION {
        return Err(bad(format!(
            "version {version}, this library reads {VERSION}"
        )));
    }
    let length = number(20);
    if length != (bytes.len() - HEADER - 8) as u64 {
        return Err(bad(format!(
            "{length} bytes announced, {} there",
            bytes.len() - HEADER - 8
        )));
    }
    let end = bytes.len() - 8;
    let mut hash = Hash::default();
    hash.add(&bytes[..end]);
    if hash.value() != number(end) {
        return Err(bad("the checksum does not agree".into()));
    }
    if number(12) != fingerprint {
        return Err(bad(
            "it was taken of another garment, resolution or fabric".into()
        ));
    }
    let state: State = postcard::from_bytes(&bytes[HEADER..end]).map_err(|e| bad(e.to_string()))?;
    check(&state, like).map_err(bad)?;
    Ok(state)
}

fn check(state: &State, like: &State) -> std::result::Result<(), String> {
    let n = like.positions.len();
    if state.positions.len() != n || state.velocities.len() != n {
        return Err(format!(
            "{} vertices, {n} are expected",
            state.positions.len()
        ));
    }
    if state.bodies.len() != like.bodies.len() {
        return Err(format!(
            "{} bodies, {} are expected",
            state.bodies.len(),
            like.bodies.len()
        ));
    }
    if state.u.len() != like.u.len()
        || state.u_rates.len() != like.u.len()
        || state.strands.len() != like.strands.len()
        || state.yarn_normals.len() != like.yarn_normals.len()
    {
        return Err(format!(
            "{} passages of yarns in {} strands, {} in {} are expected",
            state.u.len(),
            state.strands.len(),
            like.u.len(),
            like.strands.len()
        ));
    }
    let fine = |v: &Vec3| v.iter().all(|c| c.is_finite());
    let yarns_fine = state.u.iter().chain(&state.u_rates).all(|u| u.is_finite())
        && state.yarn_normals.iter().all(fine)
        && state.strands.iter().all(|s| {
            s.anchor.is_finite()
                && s.beside.is_finite()
                && s.contact.is_finite()
                && s.contact >= 0.0
        });
    let bodies_fine = state.bodies.iter().all(|b| {
        fine(&b.pose.position)
            && fine(&b.target.position)
            && b.vertices.iter().chain(&b.target_vertices).all(fine)
            && [b.pose.rotation, b.target.rotation]
                .iter()
                .all(|r| (r.as_ref().norm() - 1.0).abs() < 1e-6)
    });
    let anchors_fine = state.body_anchors.iter().all(|a| {
        (a.vertex as usize) < n
            && (a.body as usize) < state.bodies.len()
            && fine(&a.point)
            && a.normal_force.is_finite()
    }) && state.body_anchors.is_sorted_by_key(|a| (a.vertex, a.body))
        && state.pair_anchors.iter().all(|a| {
            a.a < a.b && (a.b as usize) < n && fine(&a.offset) && a.normal_force.is_finite()
        })
        && state.pair_anchors.is_sorted_by_key(|a| (a.a, a.b));
    let pins_fine = state
        .pins
        .iter()
        .all(|p| (p.vertex as usize) < n && fine(&p.target))
        && state.pins.windows(2).all(|w| w[0].vertex < w[1].vertex);
    let numbers_fine = state.time.is_finite()
        && state.step_size > 0.0
        && fine(&state.gravity)
        && fine(&state.wind)
        && state.pressure.is_finite();
    if !(bodies_fine
        && yarns_fine
        && anchors_fine
        && pins_fine
        && numbers_fine
        && state.positions.iter().chain(&state.velocities).all(fine))
    {
        return Err("it holds numbers that cannot be".into());
    }
    Ok(())
}
