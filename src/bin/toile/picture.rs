//! `toile picture`: draws a garment's model file and its bodies.

use crate::output::{Done, Failure, not_written};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use toile::body::read_obj;
use toile::error::Error;
use toile::math::Vec3;
use toile::readout::Part;
use toile::readout::picture::{PictureOptions, render};
use toile::scene::Scene;

/// Options for a picture of this width and height, if they were given [pixel].
pub(crate) fn sized(size: Option<[usize; 2]>) -> PictureOptions {
    let mut options = PictureOptions::default();
    if let Some([width, height]) = size {
        (options.width, options.height) = (width, height);
    }
    options
}

/// Options for a picture of a scene: up is against its gravity.
pub(crate) fn upright(scene: &Scene, size: Option<[usize; 2]>) -> PictureOptions {
    let up = -Vec3::from(scene.gravity);
    let options = PictureOptions {
        // up is against gravity; without gravity it is y
        up: up.try_normalize(1e-9).unwrap_or_else(Vec3::y),
        ..sized(size)
    };
    if options.up.cross(&options.front).norm() < 1e-3 {
        PictureOptions {
            front: -Vec3::y(),
            ..options
        }
    } else {
        options
    }
}

pub(crate) fn picture(
    garment: &Path,
    bodies: &[PathBuf],
    scale: f64,
    out: &Path,
    size: Option<[usize; 2]>,
) -> Done {
    let (positions, triangles) = read_obj(garment, 1.0)?;
    if triangles.is_empty() {
        return Err(Failure::from(Error::geometry(format!(
            "{}: no faces to draw",
            garment.display()
        ))));
    }
    let pieces = pieces(positions.len(), &triangles);
    let mut parts = vec![Part::garment("garment", &positions, &triangles, &pieces)];
    for path in bodies {
        let (positions, triangles) = read_obj(path, scale)?;
        parts.push(Part::body(&path.to_string_lossy(), positions, triangles));
    }
    render(&parts, &sized(size))?
        .write_png(out)
        .map_err(not_written)?;
    Ok(ExitCode::SUCCESS)
}

/// The connected piece of each vertex, numbered in the order of their first vertices: panels share
/// no vertices, so each piece is a panel.
fn pieces(count: usize, triangles: &[[u32; 3]]) -> Vec<u32> {
    let mut parent: Vec<usize> = (0..count).collect();
    for t in triangles {
        let roots = t.map(|v| root(&mut parent, v as usize));
        // the smallest vertex of a piece is its root
        let least = roots[0].min(roots[1]).min(roots[2]);
        roots.into_iter().for_each(|r| parent[r] = least);
    }
    let mut number = vec![0; count];
    let mut next = 0;
    for v in 0..count {
        let r = root(&mut parent, v);
        if r == v {
            number[v] = next;
            next += 1;
        } else {
            number[v] = number[r];
        }
    }
    number
}

fn root(parent: &mut [usize], mut v: usize) -> usize {
    while parent[v] != v {
        // halves the path on the way
        parent[v] = parent[parent[v]];
        v = parent[v];
    }
    v
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_connected_piece_has_its_own_number() {
        let triangles = [[4, 1, 0], [2, 3, 5], [5, 6, 3], [1, 7, 4]];
        assert_eq!(pieces(9, &triangles), [0, 0, 1, 1, 0, 1, 1, 0, 2]);
        assert_eq!(pieces(0, &[]), Vec::<u32>::new());
    }
}
