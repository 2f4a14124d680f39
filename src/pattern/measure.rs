//! Measures of panels: edge lengths, perimeter, area, bounding boxes. Metres; curves are taken
//! exactly (quadrature to 1e-12), not as polygons.

use super::curve::Segment;
use super::{Edge, Garment, Panel};
use crate::error::{Error, Result};
use crate::math::{Vec2, Vec3};

impl Panel {
    /// The edge's curve with its corners; `None` if it names a corner that is not there.
    pub fn segment(&self, edge: &Edge) -> Option<Segment> {
        Some(Segment {
            start: *self.vertices.get(edge.start as usize)?,
            end: *self.vertices.get(edge.end as usize)?,
            curve: edge.curve,
        })
    }

    /// Curves of all edges, outline first, then hole after hole.
    pub fn segments(&self) -> Result<Vec<Segment>> {
        self.edges()
            .enumerate()
            .map(|(k, edge)| {
                self.segment(edge).ok_or_else(|| {
                    Error::geometry(format!(
                        "panel '{}' edge {k}: corners {} and {} of {}",
                        self.name,
                        edge.start,
                        edge.end,
                        self.vertices.len()
                    ))
                })
            })
            .collect()
    }

    /// Ranges of edge numbers: the outline's, then each hole's.
    pub fn loops(&self) -> Vec<std::ops::Range<usize>> {
        let mut ranges = Vec::with_capacity(1 + self.holes.len());
        let mut first = 0;
        for count in std::iter::once(self.outline.len()).chain(self.holes.iter().map(Vec::len)) {
            ranges.push(first..first + count);
            first += count;
        }
        ranges
    }

    /// Area inside the outline, holes not subtracted [m^2]; positive for a counter-clockwise loop.
    pub fn signed_outline_area(&self) -> Result<f64> {
        let segments = self.segments()?;
        Ok(segments[..self.outline.len()]
            .iter()
            .map(Segment::area_term)
            .sum())
    }

    /// Area of cloth: outline minus holes [m^2].
    pub fn area(&self) -> Result<f64> {
        let segments = self.segments()?;
        let mut area = 0.0;
        for (k, range) in self.loops().into_iter().enumerate() {
            let part: f64 = segments[range].iter().map(Segment::area_term).sum();
            area += if k == 0 { part.abs() } else { -part.abs() };
        }
        Ok(area)
    }

    /// Length of the outline [m].
    pub fn perimeter(&self) -> Result<f64> {
        let segments = self.segments()?;
        Ok(segments[..self.outline.len()]
            .iter()
            .map(Segment::length)
            .sum())
    }

    /// Box around the outline in flat coordinates [m]; `None` without edges.
    pub fn bounds(&self) -> Result<Option<[Vec2; 2]>> {
        let segments = self.segments()?;
        Ok(segments
            .iter()
            .map(Segment::bounds)
            .reduce(|[a, b], [c, d]| [a.inf(&c), b.sup(&d)]))
    }

    /// Box around the placed panel, before sewing [m]; `None` without edges.
    ///
    /// Each world coordinate is linear in `(u, v)`, so its extremes along a curve are found in a
    /// frame turned so that the coordinate becomes an axis.
    pub fn placed_bounds(&self) -> Result<Option<[Vec3; 2]>> {
        let segments = self.segments()?;
        if segments.is_empty() {
            return Ok(None);
        }
        let matrix = self.placement.rotation.to_rotation_matrix();
        let (mut low, mut high) = (Vec3::zeros(), Vec3::zeros());
        for k in 0..3 {
            let row = Vec2::new(matrix[(k, 0)], matrix[(k, 1)]);
            let scale = row.norm();
            let shift = self.placement.translation[k];
            if scale <= 1e-300 {
                (low[k], high[k]) = (shift, shift);
                continue;
            }
            let axis = row / scale;
            let turn = |p: Vec2| Vec2::new(axis.dot(&p), -axis.y * p.x + axis.x * p.y);
            let [a, b] = segments
                .iter()
                .map(|s| s.mapped(turn).bounds())
                .reduce(|[a, b], [c, d]| [a.inf(&c), b.sup(&d)])
                .unwrap_or([Vec2::zeros(); 2]);
            (low[k], high[k]) = (scale * a.x + shift, scale * b.x + shift);
        }
        Ok(Some([low, high]))
    }
}

impl Segment {
    /// The segment in other coordinates; `map` must be a rotation and translation.
    #[must_use]
    pub fn mapped(&self, map: impl Fn(Vec2) -> Vec2) -> Self {
        use super::curve::Curve;
        Self {
            start: map(self.start),
            end: map(self.end),
            curve: match self.curve {
                Curve::Quadratic(c) => Curve::Quadratic(map(c)),
                Curve::Cubic(c, d) => Curve::Cubic(map(c), map(d)),
                other => other,
            },
        }
    }
}

impl Garment {
    /// Target edge length of a panel [m]: its own or the garment's.
    pub fn panel_edge_length(&self, panel: &Panel) -> f64 {
        panel.edge_length.unwrap_or(self.edge_length)
    }

    /// Vertices that a triangulation with these target lengths, times `scale`, will have, roughly.
    pub fn estimated_vertices(&self, scale: f64) -> Result<f64> {
        let each = |panel: &Panel| panel.estimated_vertices(scale * self.panel_edge_length(panel));
        self.panels.iter().map(each).sum()
    }
}

impl Panel {
    /// Vertices that a triangulation with target length `h` [m] will have, roughly: one for each
    /// `sqrt(3)/2 h^2` of cloth and half of one for each `h` of boundary.
    pub fn estimated_vertices(&self, h: f64) -> Result<f64> {
        let boundary: f64 = self.segments()?.iter().map(Segment::length).sum();
        Ok(self.area()? / (0.866 * h * h) + 0.5 * boundary / h + self.edge_count() as f64)
    }
}
