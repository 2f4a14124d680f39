//! Stitch maps: what is read, what is refused, and fabrics of yarns in files.

use crate::common_data::data_dir;
use crate::sheets::Random;
use crate::yarn_common::{garment, laid, rectangle};
use std::path::Path;
use toile::math::Vec2;
use toile::pattern::chart::{Chart, Face, Notation, Stack, Stitch};
use toile::pattern::export::{fabric_to_json, garment_to_json};
use toile::pattern::import::{fabric_from_json, garment_from_json};
use toile::pattern::yarn_fabric::{Mask, PRESETS, Structure, WEAVES};
use toile::pattern::{Fabric, YarnFabric};
use toile::yarn::YarnMaterial;

const KNIT: Stitch = Stitch::Plain(Face::Knit);
const PURL: Stitch = Stitch::Plain(Face::Purl);

fn loops(row: &[Stitch]) -> [usize; 2] {
    [
        row.iter().map(Stitch::takes).sum(),
        row.iter().map(Stitch::makes).sum(),
    ]
}

#[test]
fn every_chart_of_the_data_is_read_and_balanced() {
    let Some(data) = data_dir() else { return };
    let mut seen = 0;
    for entry in std::fs::read_dir(data.join("knit")).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_stem().unwrap().to_string_lossy().into_owned();
        let text = std::fs::read_to_string(&path).unwrap_or_default();
        if name.starts_with("chart_") {
            let chart = Chart::from_grid(&text).unwrap();
            chart.check_repeat().unwrap();
            let lines: Vec<&str> = text.lines().filter(|l| !l.starts_with('#')).collect();
            assert_eq!(chart.rows().len(), lines.len(), "{name}");
            for row in chart.rows() {
                let [takes, makes] = loops(row);
                assert_eq!((takes, makes), (lines[0].len(), lines[0].len()), "{name}");
            }
            seen += 1;
        } else if name.starts_with("stitchgraph_") {
            let chart = Chart::from_worked(&text).unwrap();
            assert_eq!(chart.notation(), Notation::Worked);
            for (a, b) in chart.rows().iter().zip(&chart.rows()[1..]) {
                assert_eq!(loops(a)[1], loops(b)[0], "{name}");
            }
            seen += 1;
        }
    }
    assert_eq!(seen, 9);
}

#[test]
fn instructions_are_turned_to_the_front() {
    // cast on, then a row of the back: its purl stitches are knit on the front, from the left
    let chart = Chart::from_worked("co 3 turn p 1 k 2 turn k 1 p 2 turn bo 3").unwrap();
    assert_eq!(chart.rows()[1], [KNIT, PURL, PURL]);
    assert_eq!(chart.rows()[2], [PURL, PURL, KNIT]);
    // repeats, and counts that are left out
    let a = Chart::from_worked("co 6 turn * p k 2 * 2").unwrap();
    let b = Chart::from_worked("co 6 turn p 1 k 2 p 1 k 2").unwrap();
    assert_eq!(a.rows(), b.rows());
}

#[test]
fn sides_of_the_cloth_agree() {
    // what the back shows of k2tog is p2tog, and the other way round
    let worked = |row: &str, side: usize| {
        let extra = if side == 1 { "" } else { "turn k 5" };
        let chart = Chart::from_worked(&format!("co 5 {extra} turn {row}")).unwrap();
        chart.rows().last().unwrap().clone()
    };
    for (front, back) in [
        ("k2tog 1 k 3", "p 3 p2tog 1"),
        ("k 1 ssk 1 k 2", "p 2 ssp 1 p 1"),
        ("k3tog 1 k 2", "p 2 p3tog 1"),
        ("kfb 1 k 4", "p 4 pfb 1"),
        ("yo 1 k 5", "p 5 yo 1"),
    ] {
        assert_eq!(worked(front, 0), worked(back, 1), "{front}");
    }
    // two turns are none
    for count in 2..=5 {
        for stack in [
            Stack::leaning_left(count),
            Stack::leaning_right(count),
            Stack::slipped_over(count),
            Stack::central(count),
        ] {
            assert_eq!(stack.turned().turned(), stack);
            let mut order = stack.order().to_vec();
            order.sort_unstable();
            assert!(order.iter().enumerate().all(|(k, o)| k == *o as usize));
        }
    }
    assert_eq!(Stack::slipped_over(3).order(), [2, 0, 1]);
    assert_eq!(Stack::central(3).order(), [1, 2, 0]);
    assert_eq!(Stack::leaning_right(2).order(), [0, 1]);
    assert_eq!(Stack::leaning_left(2).order(), [1, 0]);
}

#[test]
fn stacks_of_five_and_yarn_overs_at_the_edge_are_read() {
    let chart = Chart::from_grid("oo5oo\n.....").unwrap();
    chart.check_repeat().unwrap();
    assert_eq!(chart.rows()[0][0], Stitch::Over);
    assert_eq!(chart.rows()[0][2].takes(), 5);
}

#[test]
fn lifted_loops_become_yarn_overs_of_the_row_below() {
    let chart = Chart::from_grid("..._\n..m.").unwrap();
    assert_eq!(
        chart.resolved(false),
        [
            vec![KNIT, KNIT, Stitch::Over, KNIT],
            vec![KNIT, KNIT, KNIT, KNIT]
        ]
    );
    let cast = Chart::from_worked("co 3 turn p 2 m1p 1 p 1").unwrap();
    let rows = cast.resolved(false);
    assert_eq!(rows[0], [Stitch::CastOn; 4]);
    assert_eq!(loops(&rows[1]), [4, 4]);
}

#[test]
fn impossible_charts_name_row_and_column() {
    for (text, place) in [
        ("", "row 1 column 1:"),
        ("# only a comment\n", "row 1 column 1:"),
        ("....\n..z.", "row 2 column 3:"),
        ("....\n...", "row 2 column 4:"),
        ("....\n..o.", "row 2 column 4:"),
        ("....\n..../", "row 2 column 5:"),
        ("....\n.././", "row 2 column 5:"),
        ("....\n....\n../.", "row 3 column 4:"),
        ("....\n++++", "row 2 column 1:"),
        ("xxxx\n....", "row 1 column 1:"),
        ("+.++", "row 1 column 1:"),
        ("____", "row 1 column 1:"),
    ] {
        let error = Chart::from_grid(text).unwrap_err().message;
        assert!(error.starts_with(place), "{text:?}: {error}");
    }
    for (text, place) in [
        ("", "row 1 column 1:"),
        ("co 4 turn k 5", "row 2 column 1:"),
        ("co 4 turn k 3", "row 2 column 1:"),
        ("co 4 turn k 3 knit 1", "row 2 column 3:"),
        ("co 4 turn * k 2", "row 2 column 1:"),
        ("co 4 turn * * 3 k 4", "row 2 column 2:"),
        ("co 4 turn k 0 k 4", "row 2 column 2:"),
        ("co 4 turn * k 9999 * 9999", "row 2 column 4:"),
        ("co 4 turn turn k 4", "row 2 column 1:"),
        ("co 4 turn co 4", "row 2 column 1:"),
    ] {
        let error = Chart::from_worked(text).unwrap_err().message;
        assert!(error.starts_with(place), "{text:?}: {error}");
    }
    let open = Chart::from_grid("...\no...").unwrap_err().message;
    assert!(open.contains("4 symbols, row 1 has 3"), "{open}");
    let growing = Chart::from_grid(".v_\n...").unwrap();
    let error = growing.check_repeat().unwrap_err().message;
    assert!(error.starts_with("row 1 column 1:"), "{error}");
}

#[test]
fn mutated_charts_are_read_or_refused_by_row_and_column() {
    let grids = [
        "o..../\\....o\n............",
        "....o^o...\n..........\n.../o.o\\..\n..........",
        "oo5oo\n.....\n-----",
        "..m.\n_vp-\n....",
    ];
    let worked = [
        "co 13 turn\np 13 turn\nk 1 k2tog 1 yo 1 k 1 yo 1 SSK 1 k 1 k2tog 1 yo 1 k 1 yo 1 SSK 1 k 1 turn\nbo 13",
        "co 14 turn k 14 turn k 1 * yo 1 k2tog 1 k 1 SSK 1 yo 1 k 1 * 2 k 1 turn p 14",
    ];
    let mut random = Random::new(5);
    let mut below = |n: usize| ((random.signed() * 0.5 + 0.5) * n as f64) as usize % n;
    let signs: Vec<char> = "./\\o-^<345abcApqvuwm+x_ \n#*0123456789kyturnbo\u{e9}"
        .chars()
        .collect();
    let (mut good, mut bad) = (0, 0);
    for k in 0..10_000 {
        let grid = k % 2 == 0;
        let text = if grid {
            grids[k / 2 % 4]
        } else {
            worked[k / 2 % 2]
        };
        let mut chars: Vec<char> = text.chars().collect();
        for _ in 0..1 + below(3) {
            let at = below(chars.len());
            let sign = signs[below(signs.len())];
            match below(4) {
                0 => chars[at] = sign,
                1 => chars.insert(at, sign),
                2 => drop(chars.remove(at)),
                _ => {
                    let part: Vec<char> = chars[at..].iter().take(9).copied().collect();
                    let to = below(chars.len());
                    drop(chars.splice(to..to, part));
                }
            }
        }
        let text: String = chars.into_iter().collect();
        let read = if grid {
            Chart::from_grid(&text).and_then(|chart| chart.check_repeat().map(|()| chart))
        } else {
            Chart::from_worked(&text)
        };
        match read {
            Ok(chart) => {
                good += 1;
                for rows in [chart.rows(), &chart.resolved(grid)] {
                    for pair in rows.windows(2) {
                        assert_eq!(loops(&pair[0])[1], loops(&pair[1])[0]);
                    }
                    let last = &rows[rows.len() - 1];
                    assert!(!grid || loops(last)[1] == loops(&rows[0])[0]);
                }
            }
            Err(error) => {
                bad += 1;
                let named = error.message.starts_with("row ") && error.message.contains(" column ");
                assert!(named, "{text:?}: {error}");
            }
        }
    }
    println!("{good} mutated charts were read, {bad} refused");
    assert!(good > 100 && bad > 1000);
}

#[test]
fn presets_are_possible_and_come_back_from_files() {
    for (name, _) in PRESETS {
        let yarns = YarnFabric::preset(name).unwrap();
        yarns.check().unwrap();
        let fabric = Fabric {
            name: (*name).into(),
            yarns: Some(yarns),
            ..Fabric::default()
        };
        let text = fabric_to_json(&fabric).unwrap();
        assert_eq!(fabric_from_json(&text).unwrap().0, fabric, "{text}");
        let short = format!("{{\"name\": \"{name}\", \"yarns\": {{\"preset\": \"{name}\"}}}}");
        assert_eq!(fabric_from_json(&short).unwrap().0, fabric);
    }
    assert!(YarnFabric::preset("felt").is_err());
}

#[test]
fn charts_and_masks_come_back_from_garments() {
    for yarns in [
        r#""chart": ["o..../\\....o", "............"], "loop_width": 0.004, "radius": 0.001"#,
        r#""instructions": ["co 4 turn", "k 4 turn", "p 4"], "once": true, "loop_width": 0.004, "loop_height": 0.003, "radius": 0.001, "friction": 0.5"#,
        r#""weave": ["xx..", ".xx.", "..xx"], "warp_pitch": 0.002, "weft_pitch": 0.003, "radius": 0.001, "damping": {"mass": 3}"#,
        r#""preset": "rib", "knit": "rib 1x1", "young": 2e7"#,
        r#""preset": "plain shirting", "weave": "satin 5", "warp_pitch": 0.002, "weft_pitch": 0.002"#,
    ] {
        let text = format!(
            r#"{{"toile_garment": 1, "fabrics": [{{"yarns": {{{yarns}}}}}],
            "panels": [{{"name": "a", "vertices": [[0, 0], [1, 0], [0, 1]], "edges": [[0, 1], [1, 2], [2, 0]]}}]}}"#
        );
        let garment = garment_from_json(&text, None).unwrap();
        garment.check().unwrap();
        let again = garment_from_json(&garment_to_json(&garment).unwrap(), None).unwrap();
        assert_eq!(again, garment);
    }
}

#[test]
fn yarns_that_cannot_be_laid_are_refused_with_the_reason() {
    for (yarns, reason) in [
        (r#""preset": "jersey", "radius": -1"#, "finite and positive"),
        (r#""preset": "jersey", "radius": 0.0076"#, "four radii"),
        (r#""preset": "jersey", "loop_height": 0.0014"#, "two radii"),
        (
            r#""preset": "jersey", "loop_width": 0.03, "loop_height": 0.003"#,
            "0.4 loop widths",
        ),
        (
            r#""preset": "plain shirting", "radius": 0.0003"#,
            "two radii",
        ),
        (
            r#""preset": "plain shirting", "friction": -0.1"#,
            "yarns.friction",
        ),
        (
            r#""preset": "plain shirting", "knit": "garter""#,
            "loop_width",
        ),
        (
            r#""weave": "plain", "knit": "garter", "radius": 1e-4"#,
            "both",
        ),
        (
            r#""knit": "garter", "chart": ["."], "loop_width": 1, "radius": 0.1"#,
            "both",
        ),
        (
            r#""chart": ["..", ".z"], "loop_width": 1, "radius": 0.1"#,
            "row 2 column 2",
        ),
        (
            r#""chart": [".v_", "..."], "loop_width": 1, "radius": 0.1"#,
            "row 1 column 1",
        ),
        (
            r#""weave": ["x.", "xy"], "warp_pitch": 1, "radius": 0.1"#,
            "row 2 column 2",
        ),
        (
            r#""weave": ["x.", "x"], "warp_pitch": 1, "radius": 0.1"#,
            "row 2 column 2",
        ),
        (
            r#""weave": ["x"], "warp_pitch": 1, "radius": 0.1"#,
            "row 1: weft 1 lies behind all warp yarns",
        ),
        (
            r#""weave": ["x.", "..", ".x"], "warp_pitch": 1, "radius": 0.1"#,
            "row 2: weft 2 lies in front of all warp yarns",
        ),
        (
            r#""weave": ["x.x", ".xx"], "warp_pitch": 1, "radius": 0.1"#,
            "column 3: warp 3 lies in front of all weft yarns",
        ),
        (r#""weave": "plain", "radius": 1e-4"#, "warp_pitch"),
        (
            r#""preset": "jersey", "knit": ["kk"]"#,
            "yarns.knit: must be text",
        ),
        (r#""radius": 1e-4"#, "preset"),
        (
            r#""weave": "plain", "warp_pitch": 1, "radius": 0.1, "twist": 1"#,
            "twist",
        ),
    ] {
        let text = format!(r#"{{"yarns": {{{yarns}}}}}"#);
        let error = fabric_from_json(&text).unwrap_err().message;
        assert!(
            error.contains("yarns") && error.contains(reason),
            "{yarns}: {error}"
        );
        // one place is named once
        assert!(error.matches("yarns.").count() <= 1, "{yarns}: {error}");
    }
}

#[test]
fn weaves_follow_their_rules() {
    let over = |name: &str, i, j| Mask::preset(name).unwrap().warp_over(i, j);
    for (i, j) in (0..7).flat_map(|i| (0..9).map(move |j| (i, j))) {
        assert_eq!(over("plain", i, j), (i + j) % 2 == 0);
        assert_eq!(over("twill 2/2", i, j), (i + j) % 4 < 2);
        assert_eq!(over("twill 3/1", i, j), (i + j) % 4 < 3);
        assert_eq!(over("satin 5", i, j), (2 * i + j) % 5 == 0);
    }
    // every yarn of them changes sides, as those of masks must
    for name in WEAVES {
        let mask = Mask::preset(name).unwrap();
        let [width, height] = mask.size();
        let lines: Vec<String> = (0..height)
            .map(|j| {
                let sign = |i| if mask.warp_over(i, j) { 'x' } else { '.' };
                (0..width).map(sign).collect()
            })
            .collect();
        let lines: Vec<&str> = lines.iter().map(String::as_str).collect();
        assert_eq!(Mask::from_lines(&lines).expect(name), mask);
    }
    let own = Mask::from_lines(&["x..", ".xx"]).unwrap();
    assert!(own.warp_over(3, 2) && own.warp_over(1, 1) && !own.warp_over(2, 2));
}

#[test]
fn yarn_numbers_are_those_of_the_energies() {
    let sweater = YarnFabric::preset("sweater").unwrap();
    let Structure::Knitted(knit) = &sweater.structure else {
        panic!("the sweater is knitted");
    };
    assert_eq!((knit.loop_width, sweater.radius), (3e-3, 7.5e-4));
    let m = YarnMaterial::from(&sweater);
    let area = std::f64::consts::PI * 7.5e-4 * 7.5e-4;
    let near = |a: f64, b: f64| (a / b - 1.0).abs() < 1e-12;
    assert!(near(m.stretch, 1e7 * area) && near(m.bending, 1e-3 * area));
    assert!(near(m.density, 750.0 * area) && near(m.shear, 1e3 * 7.5e-4 * 7.5e-4));
    // the published rigidity of the sweater's yarn, and its mass by the packing rule
    assert!((m.bending - 1.8e-9).abs() < 0.05e-9 && (m.density - 1.3e-3).abs() < 0.05e-3);
}

#[test]
fn fabrics_of_the_documentation_are_read_and_laid() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/yarns.md");
    let text = std::fs::read_to_string(path).unwrap();
    let mut seen = 0;
    for block in text.split("```json\n").skip(1) {
        let json = block.split("```").next().unwrap();
        let yarns = fabric_from_json(json).unwrap().0.yarns.unwrap();
        laid(&garment(rectangle(Vec2::new(0.08, 0.06)), yarns));
        seen += 1;
    }
    assert_eq!(seen, 5);
    // every symbol stands in the table
    for symbol in toile::pattern::chart::grid::symbols() {
        assert!(
            text.contains(&format!("`{}`", symbol.sign)),
            "{}",
            symbol.name
        );
    }
}
