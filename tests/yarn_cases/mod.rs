//! Small cloths of yarns made by hand, their unknowns, and states on which every energy is tried.

use crate::sheets::{NoBodies, Random};
use toile::math::{Rotation, Vec2, Vec3};
use toile::system::state::{State, StrandState};
use toile::system::term::{Configuration, Term, World};
use toile::system::yarn::unknowns::Unknowns;
use toile::system::yarn::{YarnOptions, terms};
use toile::yarn::{
    Corner, Family, Incidence, Spacing, StitchSpring, Strand, Tie, Wrap, YarnMaterial, YarnMesh,
};

/// Pitch of the small cloths [m].
pub const P: f64 = 1e-3;

pub const MATERIAL: YarnMaterial = YarnMaterial {
    radius: 0.25e-3,
    density: 1.5e-4,
    stretch: 2.0,
    bending: 6e-10,
    wrapping: 1e-3,
    stitch: 2.0,
    shear: 6e-5,
    spacing: 2e6,
    friction: 0.3,
    anchor: 300.0,
    sliding_damping: 1e-3,
    damping_mass: 5.0,
    damping_stiffness: 0.01,
};

/// Yarns through `nodes` at `uv`, `u` by straight lengths. The stack of a node lists its yarns in
/// the order of `stack(node)`, as pairs of yarn and group; a yarn slides inside, where it meets others.
pub fn lay(
    uv: Vec<Vec2>,
    yarns: &[(Family, Vec<u32>)],
    stack: impl Fn(usize) -> Vec<(usize, u8)>,
) -> YarnMesh {
    let mut mesh = YarnMesh {
        lift: vec![0.0; uv.len()],
        node_panel: vec![0; uv.len()],
        starts: vec![0],
        stack_starts: vec![0],
        uv,
        ..YarnMesh::default()
    };
    for (family, nodes) in yarns {
        let mut u = 0.0;
        for (k, &node) in nodes.iter().enumerate() {
            if k > 0 {
                u += (mesh.uv[node as usize] - mesh.uv[nodes[k - 1] as usize]).norm();
            }
            let crossed = yarns.iter().filter(|y| y.1.contains(&node)).count() > 1;
            mesh.incidences.push(Incidence {
                node,
                u,
                slides: crossed && k > 0 && k + 1 < nodes.len(),
            });
        }
        mesh.starts.push(mesh.incidences.len() as u32);
        mesh.yarn_fabric.push(0);
        mesh.yarn_family.push(*family);
    }
    for node in 0..mesh.uv.len() {
        for (yarn, group) in stack(node) {
            let at = yarns[yarn].1.iter().position(|&n| n as usize == node);
            let incidence = mesh.starts[yarn] + at.expect("the yarn passes the node") as u32;
            mesh.stacks.push(Strand { incidence, group });
        }
        mesh.stack_starts.push(mesh.stacks.len() as u32);
    }
    mesh
}

/// Plain weave of `nx` x `ny` crossings: wefts first, then warps; warp in front where `i + j` is even.
pub fn weave(nx: usize, ny: usize) -> YarnMesh {
    let node = |i: usize, j: usize| (j * nx + i) as u32;
    let uv = (0..nx * ny)
        .map(|n| Vec2::new((n % nx) as f64 * P, (n / nx) as f64 * P))
        .collect();
    let mut yarns = Vec::new();
    for j in 0..ny {
        yarns.push((Family::Weft, (0..nx).map(|i| node(i, j)).collect()));
    }
    for i in 0..nx {
        yarns.push((Family::Warp, (0..ny).map(|j| node(i, j)).collect()));
    }
    let mut mesh = lay(uv, &yarns, |n| {
        let (i, j) = (n % nx, n / nx);
        let (weft, warp) = ((j, 0), (ny + i, 1));
        if (i + j) % 2 == 0 {
            vec![weft, warp]
        } else {
            vec![warp, weft]
        }
    });
    for j in 0..ny {
        for i in 0..nx {
            let beside = |d: bool, k: usize, n: usize| match d {
                true if k + 1 < n => Some(k + 1),
                false if k > 0 => Some(k - 1),
                _ => None,
            };
            for (a, b) in [(true, true), (true, false), (false, true), (false, false)] {
                if let (Some(k), Some(l)) = (beside(a, i, nx), beside(b, j, ny)) {
                    mesh.corners.push(Corner {
                        nodes: [node(i, j), node(k, j), node(i, l)],
                        length: P,
                    });
                }
            }
        }
    }
    for y in 0..mesh.yarn_count() {
        for i in mesh.starts[y]..mesh.starts[y + 1] - 1 {
            mesh.spacings.push(Spacing {
                incidences: [i, i + 1],
                least: 0.95 * P,
                length: P,
            });
        }
    }
    mesh.ties.push(Tie {
        node: 0,
        segment: [node(1, 1), node(2, 1)],
        t: 0.3,
        length: P,
    });
    mesh
}

/// The left contact of a knit stitch whose old loop is doubled: new yarn, and two old yarns beside each other.
pub fn stitch() -> YarnMesh {
    let (w, h) = (3.0 * P, 2.55 * P);
    let uv = [
        (-0.17 * w, 0.1 * h),
        (-0.36 * w, -0.1 * h),
        // leg up and sinker of the new yarn
        (-0.36 * w, 0.9 * h),
        (-0.64 * w, -0.12 * h),
        // head and leg down of the old yarns
        (0.17 * w, 0.1 * h),
        (-0.17 * w, -0.9 * h),
        (0.2 * w, 0.15 * h),
        (-0.15 * w, -0.8 * h),
    ];
    let yarns = [
        (Family::Course, vec![2, 0, 1, 3]),
        (Family::Course, vec![4, 0, 1, 5]),
        (Family::Course, vec![6, 0, 1, 7]),
    ];
    let uv: Vec<Vec2> = uv.iter().map(|p| Vec2::new(p.0, p.1)).collect();
    let mut mesh = lay(uv, &yarns, |n| match n {
        0 => vec![(2, 1), (1, 1), (0, 0)],
        1 => vec![(0, 0), (2, 1), (1, 1)],
        2 | 3 => vec![(0, 0)],
        4 | 5 => vec![(1, 0)],
        _ => vec![(2, 0)],
    });
    let length = (mesh.uv[1] - mesh.uv[0]).norm();
    for old in [4, 8] {
        for wings in [[old, 3], [0, old + 3]] {
            mesh.wraps.push(Wrap {
                axis: [0, 1],
                wings,
                length,
                sign: 1.0,
            });
        }
    }
    for y in 0..3 {
        mesh.stitch_springs.push(StitchSpring {
            incidences: [4 * y + 1, 4 * y + 2],
            length,
        });
    }
    mesh
}

/// A cloth, where its scalars are, and its terms.
pub struct Cloth {
    pub name: String,
    pub mesh: YarnMesh,
    pub unknowns: Unknowns,
    pub terms: Vec<Box<dyn Term>>,
}

/// Blocks before the first node, as of a cloth of triangles.
pub const BEFORE: u32 = 2;

pub fn cloth(name: &str, mesh: YarnMesh, slides: impl Fn(usize) -> bool) -> Cloth {
    let sliding: Vec<bool> = mesh
        .incidences
        .iter()
        .enumerate()
        .map(|(i, p)| p.slides && slides(i))
        .collect();
    let first_slide = BEFORE + mesh.uv.len() as u32;
    let unknowns = Unknowns::new(&mesh, BEFORE, first_slide, &sliding).expect("unknowns");
    let terms =
        terms(&mesh, &[MATERIAL], &unknowns, &YarnOptions::default()).expect("terms of yarns");
    Cloth {
        name: name.to_string(),
        mesh,
        unknowns,
        terms,
    }
}

/// Both meshes with none, some and all of their coordinates sliding.
pub fn cloths() -> Vec<Cloth> {
    let mut all = Vec::new();
    let mut twice = stitch();
    // a node that is in a stencil twice
    twice.wraps.push(Wrap {
        wings: [0, 0],
        ..twice.wraps[0]
    });
    for (name, mesh) in [("weave", weave(5, 4)), ("stitch", twice)] {
        for (set, slides) in [("frozen", 0), ("sliding", 1), ("third", 3), ("half", 2)] {
            all.push(cloth(&format!("{name} {set}"), mesh.clone(), |i| {
                slides > 0 && i % slides == 0
            }));
        }
    }
    all
}

impl Cloth {
    /// Blocks of unknowns for positions of nodes and coordinates.
    pub fn blocks(&self, x: &[Vec3], u: &[f64]) -> Vec<Vec3> {
        let mut out = vec![Vec3::new(0.3, -0.2, 0.1); BEFORE as usize];
        out.extend_from_slice(x);
        out.resize(out.len() + self.unknowns.slide_blocks(), Vec3::zeros());
        for (slide, u) in self.unknowns.slides.iter().zip(u) {
            if let Some((block, c)) = slide {
                out[*block as usize][usize::from(*c)] = *u;
            }
        }
        out
    }

    /// Whether a block holds a position.
    pub fn is_position(&self, block: u32) -> bool {
        block < self.unknowns.first_slide
    }

    /// Laid coordinates.
    pub fn u(&self) -> Vec<f64> {
        self.mesh.incidences.iter().map(|i| i.u).collect()
    }

    /// Laid positions, somewhere in space.
    pub fn laid(&self) -> Vec<Vec3> {
        let turn = Rotation::from_euler_angles(0.3, -1.1, 2.0);
        let offset = Vec3::new(4e-3, -3e-3, 5e-3);
        let place = |p: &Vec2| turn * Vec3::new(p.x, p.y, 0.0) + offset;
        self.mesh.uv.iter().map(place).collect()
    }

    /// A state with rates, anchors near the coordinates, and normal forces.
    pub fn state(&self, x: &[Vec3], u: &[f64], seed: u64) -> State {
        let mut random = Random::new(seed);
        let mut state = empty(self.blocks(x, u));
        for v in &mut state.velocities {
            *v = random.vec3(0.1);
        }
        state.u = u.to_vec();
        state.u_rates = u.iter().map(|_| 0.1 * random.signed()).collect();
        state.sliding = vec![false; u.len()];
        state.strands = self
            .mesh
            .stacks
            .iter()
            .map(|s| StrandState {
                anchor: u[s.incidence as usize] + 0.1 * P * random.signed(),
                beside: 0.1 * P * random.signed(),
                contact: 0.05 * (1.0 + random.signed()),
            })
            .collect();
        state.yarn_normals = vec![Vec3::zeros(); self.mesh.uv.len()];
        state
    }
}

/// A state of these blocks and nothing else.
pub fn empty(blocks: Vec<Vec3>) -> State {
    State {
        time: 0.0,
        velocities: vec![Vec3::zeros(); blocks.len()],
        positions: blocks,
        pins: Vec::new(),
        bodies: Vec::new(),
        body_anchors: Vec::new(),
        pair_anchors: Vec::new(),
        step_size: f64::INFINITY,
        gravity: WORLD.gravity,
        wind: Vec3::zeros(),
        pressure: 0.0,
        topology: Default::default(),
        u: Vec::new(),
        u_rates: Vec::new(),
        sliding: Vec::new(),
        strands: Vec::new(),
        yarn_normals: Vec::new(),
    }
}

pub static WORLD: World<'static> = World {
    gravity: Vec3::new(1.0, 2.0, -9.81),
    wind: Vec3::new(0.0, 0.0, 0.0),
    pressure: 0.0,
    bodies: &NoBodies,
};

pub struct Case {
    pub name: &'static str,
    pub x: Vec<Vec3>,
    pub x0: Vec<Vec3>,
    pub u: Vec<f64>,
    pub inv_dt: f64,
}

impl Case {
    pub fn at(&self) -> Configuration<'_> {
        Configuration {
            x: &self.x,
            x0: &self.x0,
            u: &self.u,
            inv_dt: self.inv_dt,
            world: &WORLD,
        }
    }
}

/// States of a cloth, as blocks: laid, random, crumpled, and nearly degenerate: `straight` bends yarns by
/// 1e-5, `folded` lays every third node almost on its successor, `axis` turns wings into the axis.
pub fn cases(cloth: &Cloth) -> Vec<Case> {
    let laid = cloth.laid();
    let u = cloth.u();
    let noisy = |seed: u64, size: f64| -> Vec<Vec3> {
        let mut random = Random::new(seed);
        laid.iter().map(|p| p + random.vec3(size * P)).collect()
    };
    let slid = |seed: u64, size: f64| -> Vec<f64> {
        let mut random = Random::new(seed);
        u.iter().map(|u| u + size * P * random.signed()).collect()
    };
    let mut folded = noisy(5, 0.2);
    for n in (0..folded.len() - 1).step_by(3) {
        folded[n] = folded[n + 1] + (folded[n] - folded[n + 1]) * 0.02;
    }
    let mut axis = noisy(6, 0.05);
    if cloth.mesh.wraps.is_empty() {
        axis = noisy(6, 0.01);
    } else {
        let e = (axis[1] - axis[0]) * 2.0;
        axis[3] = axis[1] + e + (axis[3] - axis[1]) * 1e-2;
        axis[4] = axis[0] - e + (axis[4] - axis[0]) * 1e-2;
    }
    let mut all = Vec::new();
    for inv_dt in [0.0, 1000.0] {
        for (name, x, s) in [
            ("laid", laid.clone(), 0.0),
            ("random", noisy(1, 0.15), 0.1),
            ("crumpled", noisy(2, 0.6), 0.15),
            ("straight", noisy(4, 1e-5), 0.02),
            ("folded", folded.clone(), 0.1),
            ("axis", axis.clone(), 0.05),
        ] {
            let start = if name == "laid" { 0.0 } else { 0.1 };
            // what does not slide has its value of the start of the step
            let u0 = slid(7, 0.5 * s);
            let now: Vec<f64> = slid(8, s)
                .iter()
                .zip(&u0)
                .zip(&cloth.unknowns.slides)
                .map(|((u, u0), slides)| if slides.is_some() { *u } else { *u0 })
                .collect();
            all.push(Case {
                name,
                x: cloth.blocks(&x, &now),
                x0: cloth.blocks(&noisy(3, start), &u0),
                u: u0,
                inv_dt,
            });
        }
    }
    all
}

/// Calls `check` for every term of every cloth in every case, lagged quantities taken.
pub fn every(mut check: impl FnMut(&Cloth, &dyn Term, &Case)) {
    let mut names = std::collections::BTreeSet::new();
    for mut cloth in cloths() {
        for case in cases(&cloth) {
            let mut state = cloth.state(&cloth.laid(), &case.u, 9);
            state.positions.clone_from(&case.x0);
            let start = Configuration {
                x: &case.x0,
                ..case.at()
            };
            let mut terms = std::mem::take(&mut cloth.terms);
            for term in &mut terms {
                term.begin_step(&state, &start);
                names.insert(term.name());
                if !term.is_idle(&case.at()) {
                    check(&cloth, term.as_ref(), &case);
                }
            }
            cloth.terms = terms;
        }
    }
    let expected = [
        "parallel_friction",
        "sliding_friction",
        "stitch_length",
        "stitch_wrapping",
        "yarn_bending",
        "yarn_gravity",
        "yarn_inertia",
        "yarn_shear",
        "yarn_spacing",
        "yarn_stretch",
        "yarn_tie",
    ];
    assert!(names.iter().eq(expected.iter()), "{names:?}");
}
