//! Wavefront OBJ: positions and faces, nothing else.
//!
//! Read here instead of with a general importer: a deforming body's host sends new vertices in the
//! order of its file, and `tobj` numbers them anew per object and drops those of no face; it reads
//! coordinates as f32 and cuts polygons into fans, which fold at a notch; and an error should name
//! its line. Understood: `v x y z [w...]`, `f i[/..][/..] ...` with positive or negative
//! numbers, `\` at the end of a line, comments; all other statements are skipped. Polygons are cut
//! into triangles by clipping ears in the plane of their Newell normal.

use crate::error::{Error, Result};
use crate::math::Vec3;

/// Largest file [bytes].
const MAX_BYTES: u64 = 1 << 30;
/// Most corners of one polygon; clipping ears costs their square.
const MAX_CORNERS: usize = 1000;

/// Positions and triangles as read.
pub(super) type Soup = (Vec<[f64; 3]>, Vec<[u32; 3]>);

/// Reads a file; errors name it and the line.
pub(super) fn read(path: &std::path::Path, scale: f64) -> Result<Soup> {
    let name = path.display();
    let io = |e: std::io::Error| Error::io(format!("{name}: {e}"));
    let meta = std::fs::metadata(path).map_err(io)?;
    if !meta.is_file() {
        return Err(Error::io(format!("{name}: not a regular file")));
    }
    if meta.len() > MAX_BYTES {
        return Err(Error::limit(format!(
            "{name}: {} bytes exceed the limit of {MAX_BYTES} for an OBJ file",
            meta.len()
        )));
    }
    parse(&std::fs::read(path).map_err(io)?, scale).map_err(|e| e.at(name))
}

/// Parses the bytes of an OBJ file; `scale` multiplies coordinates.
pub(super) fn parse(bytes: &[u8], scale: f64) -> Result<Soup> {
    super::analytic::positive("scale", scale)?;
    let mut positions: Vec<[f64; 3]> = Vec::new();
    let mut triangles: Vec<[u32; 3]> = Vec::new();
    let mut joined: Vec<u8> = Vec::new();
    let mut corners: Vec<u32> = Vec::new();
    let mut first = 1;
    for (n, raw) in bytes.split(|&b| b == b'\n').enumerate() {
        let raw = raw.strip_suffix(b"\r").unwrap_or(raw);
        if joined.is_empty() {
            first = n + 1;
        }
        if let Some(head) = raw.strip_suffix(b"\\") {
            joined.extend_from_slice(head);
            joined.push(b' ');
            continue;
        }
        joined.extend_from_slice(raw);
        statement(&joined, scale, &mut positions, &mut triangles, &mut corners)
            .map_err(|e| e.at(format!("line {first}")))?;
        joined.clear();
    }
    if !joined.is_empty() {
        statement(&joined, scale, &mut positions, &mut triangles, &mut corners)
            .map_err(|e| e.at(format!("line {first}")))?;
    }
    Ok((positions, triangles))
}

fn statement(
    line: &[u8],
    scale: f64,
    positions: &mut Vec<[f64; 3]>,
    triangles: &mut Vec<[u32; 3]>,
    corners: &mut Vec<u32>,
) -> Result<()> {
    let start = line
        .iter()
        .position(|b| !b.is_ascii_whitespace())
        .unwrap_or(line.len());
    let line = &line[start..];
    let word = line
        .iter()
        .position(u8::is_ascii_whitespace)
        .unwrap_or(line.len());
    let (word, rest) = line.split_at(word);
    if word != b"v" && word != b"f" {
        return Ok(());
    }
    let text = std::str::from_utf8(rest)
        .map_err(|_| Error::parse("the statement is not text"))?
        .split('#')
        .next()
        .unwrap_or("");
    if word == b"v" {
        let mut p = [0.0; 3];
        let mut words = text.split_ascii_whitespace();
        for (d, slot) in p.iter_mut().enumerate() {
            let word = words
                .next()
                .ok_or_else(|| Error::parse(format!("vertex has {d} coordinates, needs 3")))?;
            let value: f64 = word
                .parse()
                .map_err(|_| Error::parse(format!("'{}' is not a number", short(word))))?;
            *slot = value * scale;
            if !slot.is_finite() {
                return Err(Error::parse(format!(
                    "coordinate '{}' times scale {scale} is not finite",
                    short(word)
                )));
            }
        }
        positions.push(p);
        return Ok(());
    }
    corners.clear();
    for word in text.split_ascii_whitespace() {
        if corners.len() == MAX_CORNERS {
            return Err(Error::limit(format!(
                "a face has more than {MAX_CORNERS} corners"
            )));
        }
        let number = word.split('/').next().unwrap_or("");
        let value: i64 = number
            .parse()
            .map_err(|_| Error::parse(format!("'{}' is not a vertex number", short(word))))?;
        let count = positions.len() as i64;
        let index = if value > 0 {
            value - 1
        } else {
            value.saturating_add(count)
        };
        if value == 0 || index < 0 || index >= count || index > i64::from(u32::MAX) {
            return Err(Error::parse(format!(
                "face names vertex {value}, but {count} vertices stand before it"
            )));
        }
        corners.push(index as u32);
    }
    if corners.len() < 3 {
        return Err(Error::parse(format!(
            "face has {} corners, needs 3",
            corners.len()
        )));
    }
    triangulate(corners, positions, triangles);
    Ok(())
}

/// The start of a word, for messages.
fn short(word: &str) -> String {
    word.chars().take(40).collect()
}

/// Ear clipping in the polygon's mean plane; what has no ear left (a self-crossing outline) is
/// cut as a fan.
fn triangulate(corners: &mut Vec<u32>, positions: &[[f64; 3]], out: &mut Vec<[u32; 3]>) {
    let at = |v: u32| Vec3::from(positions[v as usize]);
    if corners.len() > 3 {
        let o = at(corners[0]);
        let n = corners.len();
        let normal = (0..n).fold(Vec3::zeros(), |s, i| {
            s + (at(corners[i]) - o).cross(&(at(corners[(i + 1) % n]) - o))
        });
        let side = |a: u32, b: u32, c: u32| (at(b) - at(a)).cross(&(at(c) - at(a))).dot(&normal);
        while corners.len() > 3 {
            let n = corners.len();
            let ear = (0..n).find(|&i| {
                let (a, b, c) = (corners[(i + n - 1) % n], corners[i], corners[(i + 1) % n]);
                side(a, b, c) > 0.0
                    && corners.iter().all(|&p| {
                        p == a
                            || p == b
                            || p == c
                            || side(a, b, p) < 0.0
                            || side(b, c, p) < 0.0
                            || side(c, a, p) < 0.0
                    })
            });
            let i = ear.unwrap_or(1);
            out.push([corners[(i + n - 1) % n], corners[i], corners[(i + 1) % n]]);
            corners.remove(i);
        }
    }
    out.push([corners[0], corners[1], corners[2]]);
}
