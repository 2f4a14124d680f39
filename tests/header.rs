//! The committed header is what the sources give, and is written for C readers.
#![allow(clippy::expect_used, reason = "a test may panic")]

use crate::capi_support as support;

#[test]
fn committed_header_is_what_the_sources_give() {
    support::compare("include/toile.h", &support::generated_header());
}

#[test]
fn header_speaks_no_rust() {
    let text = support::generated_header();
    for word in [
        "# Safety", "Rust", "rust", "usize", "Option", "&mut", "Vec<", "unsafe", "panic!",
        "cbindgen", "[`", "Result<", "::", "crate", " u32", " f64", "trait",
    ] {
        let place = text.lines().find(|l| l.contains(word));
        assert!(place.is_none(), "'{word}' in the header: {place:?}");
    }
    assert!(text.is_ascii());
}

#[test]
fn every_name_of_the_header_is_in_the_library_s_style() {
    let text = support::without_comments(&support::generated_header());
    let words = text.split(|c: char| !(c.is_alphanumeric() || c == '_'));
    let mut seen = 0;
    for word in words {
        let lower = word.to_lowercase();
        if lower.starts_with("toile") {
            seen += 1;
            assert!(
                word == lower || word == word.to_uppercase(),
                "{word} mixes cases"
            );
            assert!(!word.ends_with("_t"), "{word}");
            assert!(!word.contains("_get_"), "{word}");
        }
    }
    assert!(seen > 100);
    // no flags, enumerations, or bit-fields cross the boundary
    for refused in ["bool ", "enum ", ": 1;"] {
        assert!(!text.contains(refused), "{refused}");
    }
}

#[test]
fn every_function_of_the_header_has_a_comment() {
    let text = support::generated_header();
    let lines: Vec<&str> = text.lines().collect();
    for name in support::header_functions() {
        let at = lines
            .iter()
            .position(|l| l.contains(&format!("{name}(")) && !l.trim_start().starts_with('*'))
            .unwrap_or_else(|| panic!("{name} is declared"));
        assert!(lines[at - 1].contains("*/"), "{name} has no comment");
    }
}

/// The names that hosts outside this repository already call, as their contract lists them.
#[test]
fn names_that_hold_are_there() {
    let there = support::header_functions();
    let hold = "
        toile_version toile_last_error toile_status_name
        toile_garment_create toile_garment_from_json toile_garment_add_panel toile_garment_add_seam
        toile_garment_set_fabric toile_garment_set_blend_region toile_garment_clear_blend_region
        toile_garment_to_json toile_garment_to_svg toile_garment_free
        toile_body_sphere toile_body_capsule toile_body_plane toile_body_grid toile_body_mesh
        toile_body_free
        toile_sim_create toile_sim_from_scene toile_sim_set_body_sdf toile_sim_set_body_pose
        toile_sim_set_body_vertices toile_sim_body_wrench toile_sim_pin toile_sim_unpin
        toile_sim_pin_yarn_nodes toile_sim_set_blend_region toile_sim_locate toile_sim_step
        toile_sim_drape toile_sim_epoch toile_sim_time toile_sim_positions toile_sim_normals
        toile_sim_vertex_panels toile_sim_vertex_uv toile_sim_vertex_active toile_sim_triangles
        toile_sim_positions_view toile_sim_yarn_nodes toile_sim_yarn_offsets toile_sim_yarn_indices
        toile_sim_energies toile_sim_save toile_sim_restore toile_sim_free toile_sim_set_number
    ";
    for name in hold.split_whitespace() {
        assert!(there.iter().any(|n| n == name), "{name} is gone");
    }
}
