//! Snapshots: the State as bytes, with what it belongs to, magic, version and a checksum.
//!
//! ```text
//! "TOILESNP" | version u32 | length u64 | origin, state | checksum u64   (little endian)
//! ```

use super::state::State;
use super::term::ContactSettings;
use crate::cloth::Cloth;
use crate::error::{Error, Result};
use crate::math::Vec3;
use crate::math::hash::Hash;
use crate::pattern::{BlendRegion, Shape};
use serde::{Deserialize, Serialize};

const MAGIC: &[u8; 8] = b"TOILESNP";
const VERSION: u32 = 3;
const HEADER: usize = 8 + 4 + 8;

/// What a state belongs to: everything else that the next bits depend on. A state means the same in
/// two simulations only if it is the same.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Origin {
    /// Of mesh and fabrics, see [`fingerprint`].
    pub garment: u64,
    /// Of each body.
    pub bodies: Vec<BodyOrigin>,
    /// Tunables by name.
    pub numbers: Vec<(String, f64)>,
}

/// A body as it came into the world.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct BodyOrigin {
    /// Fingerprint of its shape.
    pub shape: u64,
    /// How it meets the cloth.
    pub contact: ContactSettings,
}

impl Origin {
    /// What is not as in `own`, the origin of the simulation that restores.
    fn difference(&self, own: &Self) -> Option<String> {
        if self.garment != own.garment {
            return Some(
                "it was taken of another garment, resolution, fabric or blend region".into(),
            );
        }
        if self.bodies.len() != own.bodies.len() {
            return Some(format!(
                "it was taken with {} bodies, here are {}",
                self.bodies.len(),
                own.bodies.len()
            ));
        }
        for (b, (theirs, ours)) in self.bodies.iter().zip(&own.bodies).enumerate() {
            if theirs.shape != ours.shape {
                return Some(format!("it was taken with another shape of body {b}"));
            }
            let numbers = |c: &ContactSettings| {
                [
                    ("friction", c.friction),
                    ("thickness", c.thickness),
                    ("stiffness", c.stiffness),
                ]
            };
            let pairs = numbers(&theirs.contact)
                .into_iter()
                .zip(numbers(&ours.contact));
            for ((name, there), (_, here)) in pairs {
                if there.to_bits() != here.to_bits() {
                    return Some(format!(
                        "it was taken with {name} {there} of body {b}, here it is {here}"
                    ));
                }
            }
        }
        let same =
            |a: &(String, f64), b: &(String, f64)| a.0 == b.0 && a.1.to_bits() == b.1.to_bits();
        let missing = own
            .numbers
            .iter()
            .find(|n| !self.numbers.iter().any(|m| same(m, n)));
        missing.map(|(name, here)| {
            let there = self.numbers.iter().find(|n| n.0 == *name);
            match there {
                Some((_, there)) => {
                    format!("it was taken with {name} = {there}, here it is {here}")
                }
                None => format!("it knows no {name}, here it is {here}"),
            }
        })
    }
}

/// A number that two systems share only if their meshes, fabrics and blend regions are the same.
pub fn fingerprint(cloth: &Cloth, regions: &[BlendRegion]) -> u64 {
    let mut hash = Hash::default();
    for p in &cloth.mesh.uv {
        hash.numbers([p.x, p.y]);
    }
    for v in cloth.mesh.triangles.iter().flatten() {
        hash.add(&v.to_le_bytes());
    }
    for link in cloth.mesh.seams.iter().flat_map(|s| &s.links) {
        hash.add(&link.vertex.to_le_bytes());
        hash.add(&link.edge[0].to_le_bytes());
        hash.numbers([link.t]);
    }
    for f in &cloth.fabrics {
        hash.add(format!("{f:?}").as_bytes());
    }
    for region in regions {
        hash.add(&region.panel.to_le_bytes());
        hash.add(&region.rings.to_le_bytes());
        match &region.shape {
            Shape::Polygon(corners) => {
                for p in corners {
                    hash.numbers([p.x, p.y]);
                }
            }
            Shape::Disc { center, radius } => {
                hash.add(b"disc");
                hash.numbers([center.x, center.y, *radius]);
            }
            Shape::Edge { edge, width } => {
                hash.add(b"edge");
                hash.add(&edge.to_le_bytes());
                hash.numbers([*width]);
            }
        }
    }
    hash.value()
}

/// Bytes of a state.
pub fn write(state: &State, origin: &Origin) -> Result<Vec<u8>> {
    let payload = postcard::to_stdvec(&(origin, state))
        .map_err(|e| Error::state(format!("snapshot: {e}")))?;
    let mut bytes = Vec::with_capacity(HEADER + payload.len() + 8);
    bytes.extend_from_slice(MAGIC);
    bytes.extend_from_slice(&VERSION.to_le_bytes());
    bytes.extend_from_slice(&(payload.len() as u64).to_le_bytes());
    bytes.extend_from_slice(&payload);
    let mut hash = Hash::default();
    hash.add(&bytes);
    bytes.extend_from_slice(&hash.value().to_le_bytes());
    Ok(bytes)
}

/// The state in `bytes`; it must belong to `own`, and fit `like`, a state of the simulation that
/// restores it.
pub fn read(bytes: &[u8], own: &Origin, like: &State) -> Result<State> {
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
    let length = number(12);
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
    // the origin first: of another one the rest may not even be a state
    let (origin, rest): (Origin, _) =
        postcard::take_from_bytes(&bytes[HEADER..end]).map_err(|e| bad(e.to_string()))?;
    if let Some(difference) = origin.difference(own) {
        return Err(bad(difference));
    }
    let state: State = postcard::from_bytes(rest).map_err(|e| bad(e.to_string()))?;
    check(&state, like).map_err(bad)?;
    Ok(state)
}

/// Refuses a state that does not fit `like`, a state of the simulation that is to take it.
pub fn check(state: &State, like: &State) -> std::result::Result<(), String> {
    // what the topology of either has added or taken
    let (own, other) = (&like.topology, &state.topology);
    let [n, nodes] = [like.positions.len(), like.yarn_normals.len()]
        .map(|n| n - own.split.len() + other.split.len());
    let passages = (like.u.len() + own.gone()).checked_sub(other.gone());
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
    let [u, rates, sliding, strands] = [
        state.u.len(),
        state.u_rates.len(),
        state.sliding.len(),
        state.strands.len(),
    ];
    if [u, rates, sliding, strands]
        .iter()
        .any(|n| Some(*n) != passages)
        || state.yarn_normals.len() != nodes
    {
        return Err(format!(
            "{u} passages of yarns in {strands} strands of {} nodes, {} of {nodes} are expected",
            state.yarn_normals.len(),
            passages.unwrap_or_default()
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
            a.a < a.b
                && (a.b as usize) < n
                && fine(&a.offset)
                && a.normal_force.is_finite()
                && a.rest.is_finite()
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
