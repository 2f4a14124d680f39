//! Charts as grids: one line a row, one symbol a stitch, as the front looks; the first line is the
//! bottom row. Lines that begin with `#` and empty lines are not read.

use super::{Chart, Face, Fan, MAX_SIDE, Notation, Stack, Stitch, refuse};
use crate::error::Result;

/// A symbol, the stitch it stands for, its name.
pub struct Symbol {
    /// As written.
    pub sign: char,
    /// What it stands for; `None` is no stitch at all.
    pub stitch: Option<Stitch>,
    /// Its name.
    pub name: &'static str,
}

/// Every symbol of the grid.
pub fn symbols() -> Vec<Symbol> {
    use Face::{Knit, Purl};
    let all = |face: Face, count: usize| Stitch::Into(Fan::new(&vec![Some(face); count]));
    [
        ('.', Some(Stitch::Plain(Knit)), "knit"),
        ('-', Some(Stitch::Plain(Purl)), "purl"),
        ('o', Some(Stitch::Over), "yarn-over"),
        (
            '/',
            Some(Stitch::Together(Knit, Stack::leaning_right(2))),
            "k2tog",
        ),
        (
            '\\',
            Some(Stitch::Together(Knit, Stack::leaning_left(2))),
            "ssk",
        ),
        (
            '^',
            Some(Stitch::Together(Knit, Stack::central(3))),
            "central double decrease",
        ),
        (
            '<',
            Some(Stitch::Together(Knit, Stack::slipped_over(3))),
            "sk2p",
        ),
        (
            '3',
            Some(Stitch::Together(Knit, Stack::leaning_right(3))),
            "k3tog",
        ),
        (
            '4',
            Some(Stitch::Together(Knit, Stack::leaning_right(4))),
            "k4tog",
        ),
        (
            '5',
            Some(Stitch::Together(Knit, Stack::leaning_right(5))),
            "k5tog",
        ),
        (
            'a',
            Some(Stitch::Together(Knit, Stack::leaning_left(3))),
            "sssk",
        ),
        (
            'b',
            Some(Stitch::Together(Knit, Stack::leaning_left(4))),
            "ssssk",
        ),
        (
            'c',
            Some(Stitch::Together(Knit, Stack::leaning_left(5))),
            "sssssk",
        ),
        (
            'A',
            Some(Stitch::Together(Knit, Stack::central(5))),
            "central quadruple decrease",
        ),
        (
            'p',
            Some(Stitch::Together(Purl, Stack::leaning_right(2))),
            "purl decrease, left loop in front",
        ),
        (
            'q',
            Some(Stitch::Together(Purl, Stack::leaning_left(2))),
            "purl decrease, right loop in front",
        ),
        ('v', Some(all(Knit, 2)), "kfb"),
        ('u', Some(all(Purl, 2)), "pfb"),
        (
            'w',
            Some(Stitch::Into(Fan::new(&[Some(Knit), None, Some(Knit)]))),
            "k-yo-k",
        ),
        ('m', Some(Stitch::Lifted(Knit)), "m1"),
        ('+', Some(Stitch::CastOn), "cast-on"),
        ('x', Some(Stitch::BindOff), "bind-off"),
        ('_', None, "no stitch"),
    ]
    .into_iter()
    .map(|(sign, stitch, name)| Symbol { sign, stitch, name })
    .collect()
}

impl Chart {
    /// Reads a grid; errors name row and column, both from 1, rows from the bottom.
    pub fn from_grid(text: &str) -> Result<Self> {
        let symbols = symbols();
        let (mut source, mut rows, mut columns) = (Vec::new(), Vec::new(), Vec::new());
        let mut width = None;
        for line in text.lines().map(str::trim_end) {
            if line.is_empty() || line.starts_with('#') {
                continue;
            }
            let number = rows.len() + 1;
            if number > MAX_SIDE {
                return Err(refuse(number, 1, format!("more than {MAX_SIDE} rows")));
            }
            let (mut row, mut places) = (Vec::new(), Vec::new());
            let mut count = 0;
            for sign in line.chars() {
                count += 1;
                if count > MAX_SIDE {
                    return Err(refuse(
                        number,
                        count,
                        format!("more than {MAX_SIDE} stitches"),
                    ));
                }
                let Some(symbol) = symbols.iter().find(|s| s.sign == sign) else {
                    let known: String = symbols.iter().map(|s| s.sign).collect();
                    return Err(refuse(
                        number,
                        count,
                        format!("unknown symbol {sign:?}; known are {known}"),
                    ));
                };
                if let Some(stitch) = symbol.stitch {
                    row.push(stitch);
                    places.push(count);
                }
            }
            let first = *width.get_or_insert(count);
            if count != first {
                return Err(refuse(
                    number,
                    count.min(first) + 1,
                    format!("{count} symbols, row 1 has {first}"),
                ));
            }
            source.push(line.to_owned());
            rows.push(row);
            columns.push(places);
        }
        Self::build(Notation::Grid, source, rows, &columns)
    }
}
