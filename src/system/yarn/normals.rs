//! Normals of contacts: the plane fitted to a node and its neighbours, and which of its sides is the front.
//!
//! In the flat panel two yarns cross one way or the other; the cross product of their directions times that
//! sign points to the front of the panel there and, as long as they cross, in space.

use crate::math::geometry::cross2;
use crate::math::{Mat3, Vec3};
use crate::yarn::YarnMesh;

/// The plane of least squares through points.
pub(super) struct Plane {
    origin: Vec3,
    sum: Vec3,
    square: Mat3,
    count: f64,
}

impl Plane {
    pub(super) fn new(origin: Vec3) -> Self {
        Self {
            origin,
            sum: Vec3::zeros(),
            square: Mat3::zeros(),
            count: 1.0,
        }
    }

    pub(super) fn add(&mut self, point: &Vec3) {
        let d = point - self.origin;
        self.sum += d;
        self.square += d * d.transpose();
        self.count += 1.0;
    }

    /// Its unit normal, to either side.
    pub(super) fn normal(&self) -> Vec3 {
        smallest_direction(&(self.square - self.sum * self.sum.transpose() / self.count))
    }
}

/// Which way a node's normal points: `sign` times the cross product of two yarns' directions.
pub(super) struct Turn {
    sign: f64,
    /// Nodes before and after along each of the two yarns.
    ends: [[u32; 2]; 2],
}

impl Turn {
    /// How the strand at the back of a node and the first one of another group cross in the flat
    /// panel; none where they do not.
    pub(super) fn new(mesh: &YarnMesh, node: usize) -> Option<Self> {
        let stack = mesh.stack(node);
        let back = stack.first()?;
        let front = stack.iter().find(|s| s.group != back.group)?;
        let ends = [back, front].map(|s| ends(mesh, s.incidence as usize));
        let [a, b] = ends.map(|[p, n]| mesh.uv[n as usize] - mesh.uv[p as usize]);
        let cross = cross2(&a, &b);
        (cross != 0.0).then(|| Self {
            sign: cross.signum(),
            ends,
        })
    }

    /// A vector to the front at positions `x`.
    pub(super) fn front(&self, x: &[Vec3]) -> Vec3 {
        let [a, b] = self.ends.map(|[p, n]| x[n as usize] - x[p as usize]);
        a.cross(&b) * self.sign
    }
}

/// Nodes before and after an incidence along its yarn in the same panel, or its own.
fn ends(mesh: &YarnMesh, i: usize) -> [u32; 2] {
    let own = mesh.incidences[i].node;
    // the last start that is not beyond the incidence is its yarn's
    let yarn = mesh.starts.partition_point(|&s| s as usize <= i) - 1;
    let range = mesh.starts[yarn] as usize..mesh.starts[yarn + 1] as usize;
    let node = |k: Option<usize>| {
        let node = k
            .filter(|k| range.contains(k))
            .map_or(own, |k| mesh.incidences[k].node);
        let same = mesh.node_panel[node as usize] == mesh.node_panel[own as usize];
        if same { node } else { own }
    };
    [node(i.checked_sub(1)), node(Some(i + 1))]
}

/// Unit vector of the smallest eigenvalue of a symmetric matrix that is not negative.
///
/// That eigenvalue is the first root of the characteristic polynomial, which Newton's method reaches from 0
/// without passing it; the vector is across the rows of what is left.
fn smallest_direction(a: &Mat3) -> Vec3 {
    let scale = a.trace();
    let minors = [(0, 1), (1, 2), (0, 2)]
        .map(|(i, j)| a[(i, i)] * a[(j, j)] - a[(i, j)] * a[(i, j)])
        .iter()
        .sum::<f64>();
    let det = a.determinant();
    let mut root = 0.0;
    for _ in 0..20 {
        let value = det - root * (minors - root * (scale - root));
        let slope = minors - root * (2.0 * scale - 3.0 * root);
        if !(value > 0.0 && slope > 0.0) {
            break;
        }
        let step = value / slope;
        root += step;
        if step <= 1e-14 * scale {
            break;
        }
    }
    let left = a - Mat3::from_diagonal_element(root);
    let rows = [0, 1, 2].map(|k| left.column(k).into_owned());
    let mut best = Vec3::zeros();
    for (i, j) in [(0, 1), (1, 2), (2, 0)] {
        let across: Vec3 = rows[i].cross(&rows[j]);
        if across.norm_squared() > best.norm_squared() {
            best = across;
        }
    }
    let size = best.norm();
    if size > 1e-6 * scale * scale {
        return best / size;
    }
    // two eigenvalues nearly agree
    let eigen = a.symmetric_eigen();
    eigen.eigenvectors.column(eigen.eigenvalues.imin()).into()
}
