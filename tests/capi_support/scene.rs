//! Small scenes made through the C interface, as a host would.

use std::ffi::{CStr, CString, c_char};
use std::ptr;
use toile::capi::*;

/// Text of the last error.
pub fn last_error() -> String {
    let text = toile_last_error();
    assert!(!text.is_null());
    unsafe { CStr::from_ptr(text) }
        .to_str()
        .expect("UTF-8")
        .to_owned()
}

/// A call that must succeed.
#[track_caller]
pub fn ok(status: toile_status) {
    assert_eq!(status, TOILE_OK, "{}", last_error());
}

/// A call that must fail in this way, with a text.
#[track_caller]
pub fn fails(status: toile_status, expected: toile_status) {
    assert_eq!(status, expected, "{}", last_error());
    assert!(!last_error().is_empty());
}

/// A struct with its defaults.
pub fn filled<T>(init: unsafe extern "C" fn(*mut T, usize) -> toile_status) -> T {
    let mut value = std::mem::MaybeUninit::uninit();
    ok(unsafe { init(value.as_mut_ptr(), size_of::<T>()) });
    unsafe { value.assume_init() }
}

/// The two calls of an array.
pub fn array<T: Copy + Default>(
    call: impl Fn(*mut T, usize, *mut usize) -> toile_status,
) -> Vec<T> {
    let mut needed = 0;
    ok(call(ptr::null_mut(), 0, &mut needed));
    let mut out = vec![T::default(); needed];
    ok(call(out.as_mut_ptr(), needed, &mut needed));
    assert_eq!(out.len(), needed);
    out
}

pub fn text(call: impl Fn(*mut c_char, usize, *mut usize) -> toile_status) -> String {
    let bytes: Vec<u8> = array::<c_char>(call).into_iter().map(|b| b as u8).collect();
    CStr::from_bytes_with_nul(&bytes)
        .expect("ends with NUL")
        .to_str()
        .expect("UTF-8")
        .to_owned()
}

macro_rules! owner {
    ($name:ident, $inner:ident, $free:ident) => {
        /// A handle that is freed.
        #[derive(Debug)]
        pub struct $name(pub *mut $inner);

        // handles are numbers; the library keeps threads apart
        unsafe impl Send for $name {}
        unsafe impl Sync for $name {}

        impl Drop for $name {
            fn drop(&mut self) {
                unsafe { $free(self.0) }
            }
        }
    };
}

owner!(Garment, toile_garment, toile_garment_free);
owner!(Body, toile_body, toile_body_free);
owner!(Sim, toile_sim, toile_sim_free);

impl Garment {
    pub fn empty(edge_length: f64) -> Self {
        let mut desc = filled(toile_garment_desc_init);
        desc.edge_length = edge_length;
        let mut out = ptr::null_mut();
        ok(unsafe { toile_garment_create(&desc, &mut out) });
        Self(out)
    }

    pub fn json(&self) -> String {
        text(|out, capacity, needed| unsafe {
            toile_garment_to_json(self.0, out, capacity, needed)
        })
    }
}

/// A panel of straight edges, level: u along x, v along -z, its outside up.
pub fn level_panel(corners: &[f64], y: f64) -> toile_panel_desc {
    let mut panel = filled(toile_panel_desc_init);
    panel.vertices = corners.as_ptr();
    panel.vertex_count = corners.len() / 2;
    panel.position[1] = y;
    panel.quaternion_xyzw = [-(0.5_f64.sqrt()), 0.0, 0.0, 0.5_f64.sqrt()];
    panel
}

/// A level square of 0.2 m around the origin.
pub fn square(edge_length: f64, y: f64) -> Garment {
    let corners = [-0.1, -0.1, 0.1, -0.1, 0.1, 0.1, -0.1, 0.1];
    let garment = Garment::empty(edge_length);
    let panel = level_panel(&corners, y);
    ok(unsafe { toile_garment_add_panel(garment.0, &panel, ptr::null_mut()) });
    garment
}

/// The tunic of `examples_c/02_panels.c`.
pub fn tunic() -> Garment {
    let garment = Garment::empty(0.045);
    let corners = [
        -0.22, 0.0, 0.22, 0.0, 0.22, 0.5, 0.08, 0.5, -0.08, 0.5, -0.22, 0.5,
    ];
    let edges: Vec<u32> = (0..6).flat_map(|i| [i, (i + 1) % 6]).collect();
    let mut kinds = [TOILE_EDGE_LINE; 6];
    kinds[3] = TOILE_EDGE_QUADRATIC;
    let mut controls = [[0.0; 4]; 6];
    controls[3][1] = 0.44;
    for (name, z) in [(c"front", 0.16), (c"back", -0.16)] {
        let mut panel = filled(toile_panel_desc_init);
        panel.name = name.as_ptr();
        panel.vertices = corners.as_ptr();
        panel.vertex_count = 6;
        panel.edges = edges.as_ptr();
        panel.edge_count = 6;
        panel.edge_kinds = kinds.as_ptr();
        panel.edge_controls = controls.as_ptr().cast();
        panel.position = [0.0, -0.03, z];
        if z < 0.0 {
            panel.quaternion_xyzw = [0.0, 1.0, 0.0, 0.0];
        }
        ok(unsafe { toile_garment_add_panel(garment.0, &panel, ptr::null_mut()) });
    }
    for (a, b) in [(1, 5), (5, 1), (2, 4), (4, 2)] {
        let mut seam = filled(toile_seam_desc_init);
        seam.panel_b = 1;
        seam.edge_a = a;
        seam.edge_b = b;
        ok(unsafe { toile_garment_add_seam(garment.0, &seam, ptr::null_mut()) });
    }
    garment
}

pub fn sphere(radius: f64) -> Body {
    let mut out = ptr::null_mut();
    ok(unsafe { toile_body_sphere(radius, &mut out) });
    Body(out)
}

impl Sim {
    pub fn new(garment: &Garment) -> Self {
        let mut out = ptr::null_mut();
        ok(unsafe { toile_sim_create(garment.0, ptr::null(), &mut out) });
        Self(out)
    }

    /// A square that falls on a sphere.
    pub fn small() -> Self {
        let sim = Self::new(&square(0.05, 0.06));
        let body = sphere(0.05);
        ok(unsafe { toile_sim_set_body_sdf(sim.0, body.0, ptr::null(), ptr::null_mut()) });
        sim
    }

    pub fn step(&self, dt: f64) -> toile_step_report {
        let mut report = filled(toile_step_report_init);
        ok(unsafe { toile_sim_step(self.0, dt, &mut report) });
        report
    }

    pub fn save(&self) -> Vec<u8> {
        array(|out, n, needed| unsafe { toile_sim_save(self.0, out, n, needed) })
    }

    pub fn positions(&self) -> Vec<f64> {
        array(|out, n, needed| unsafe { toile_sim_positions(self.0, out, n, needed) })
    }

    pub fn vertex_count(&self) -> usize {
        self.positions().len() / 3
    }

    pub fn epoch(&self) -> u64 {
        unsafe { toile_sim_epoch(self.0) }
    }

    pub fn number(&self, name: &str) -> f64 {
        let name = CString::new(name).expect("no NUL");
        let mut value = f64::NAN;
        ok(unsafe { toile_sim_number(self.0, name.as_ptr(), &mut value) });
        value
    }
}

/// A closed triangle mesh of a capsule along y: positions and triangles.
pub fn capsule_mesh(half_length: f64, radius: f64) -> (Vec<f64>, Vec<u32>) {
    const RINGS: u32 = 16;
    const SECTORS: u32 = 32;
    let pi = std::f64::consts::PI;
    let mut points = vec![0.0, half_length + radius, 0.0];
    for r in 1..RINGS {
        let a = pi * f64::from(r) / f64::from(RINGS);
        // the ring at the equator is there twice: once for each half
        for shift in if r == RINGS / 2 {
            vec![1.0, -1.0]
        } else {
            vec![(a.cos()).signum()]
        } {
            for s in 0..SECTORS {
                let b = 2.0 * pi * f64::from(s) / f64::from(SECTORS);
                points.extend([
                    radius * a.sin() * b.cos(),
                    shift * half_length + radius * a.cos(),
                    -radius * a.sin() * b.sin(),
                ]);
            }
        }
    }
    points.extend([0.0, -half_length - radius, 0.0]);
    let last = (points.len() / 3 - 1) as u32;
    let rings = (last - 1) / SECTORS;
    let at = |r: u32, s: u32| 1 + r * SECTORS + s % SECTORS;
    let mut triangles = Vec::new();
    for s in 0..SECTORS {
        triangles.extend([0, at(0, s), at(0, s + 1)]);
        for r in 0..rings - 1 {
            triangles.extend([at(r, s), at(r + 1, s), at(r + 1, s + 1)]);
            triangles.extend([at(r, s), at(r + 1, s + 1), at(r, s + 1)]);
        }
        triangles.extend([last, at(rings - 1, s + 1), at(rings - 1, s)]);
    }
    (points, triangles)
}

/// That mesh as a Wavefront file.
pub fn capsule_obj(half_length: f64, radius: f64) -> String {
    use std::fmt::Write as _;
    let (points, triangles) = capsule_mesh(half_length, radius);
    let mut out = String::new();
    for p in points.chunks(3) {
        let _ = writeln!(out, "v {} {} {}", p[0], p[1], p[2]);
    }
    for t in triangles.chunks(3) {
        let _ = writeln!(out, "f {} {} {}", t[0] + 1, t[1] + 1, t[2] + 1);
    }
    out
}
