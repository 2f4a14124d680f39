//! The binary interface: exported symbols, struct layouts, constants, version.
#![allow(clippy::expect_used, reason = "a test may panic")]

use crate::capi_support as support;
use std::fmt::Write as _;
use std::process::Command;

fn exported() -> Vec<String> {
    let library = support::library_dir().join("libtoile.so");
    let output = Command::new("nm")
        .args(["-D", "--defined-only", "--format=posix"])
        .arg(&library)
        .output()
        .expect("nm");
    assert!(output.status.success());
    String::from_utf8(output.stdout)
        .expect("UTF-8")
        .lines()
        .filter_map(|l| l.split_whitespace().next())
        .map(str::to_owned)
        .collect()
}

/// FMI names its functions itself; they are no part of the header.
fn is_fmi(name: &str) -> bool {
    name.starts_with("fmi2") || name.starts_with("fmi3")
}

#[test]
fn exported_symbols_are_the_functions_of_the_header_and_nothing_else() {
    if !support::has("nm") {
        return support::skip("nm is not installed");
    }
    let mut names: Vec<String> = exported().into_iter().filter(|n| !is_fmi(n)).collect();
    names.sort();
    assert_eq!(names, support::header_functions());
}

#[test]
fn version_constants_are_cargo_s() {
    let header = support::header();
    for (name, value) in [
        ("MAJOR", env!("CARGO_PKG_VERSION_MAJOR")),
        ("MINOR", env!("CARGO_PKG_VERSION_MINOR")),
        ("PATCH", env!("CARGO_PKG_VERSION_PATCH")),
    ] {
        let line = format!("#define TOILE_VERSION_{name} {value}\n");
        assert!(header.contains(&line), "{line}");
    }
    let number = |s: &str| s.parse::<u32>().expect("number");
    assert_eq!(
        toile::capi::toile_version(),
        number(env!("CARGO_PKG_VERSION_MAJOR")) * 10_000
            + number(env!("CARGO_PKG_VERSION_MINOR")) * 100
            + number(env!("CARGO_PKG_VERSION_PATCH"))
    );
}

/// Structs of the header with their fields, in its order.
fn structs(header: &str) -> Vec<(String, Vec<String>)> {
    let text = support::without_comments(header);
    let mut found = Vec::new();
    let mut rest = text.as_str();
    while let Some(i) = rest.find("typedef struct ") {
        rest = &rest[i + "typedef struct ".len()..];
        let name: String = rest.chars().take_while(|c| !c.is_whitespace()).collect();
        let Some(body) = rest[name.len()..].trim_start().strip_prefix('{') else {
            continue; // opaque
        };
        let body = &body[..body.find('}').expect("struct ends")];
        let fields = body
            .split(';')
            .map(str::trim)
            .filter(|f| !f.is_empty())
            .map(|f| {
                let f = f.split('[').next().expect("declarator");
                f.rsplit(|c: char| !(c.is_alphanumeric() || c == '_'))
                    .next()
                    .expect("name")
                    .to_owned()
            })
            .collect();
        found.push((name, fields));
    }
    found
}

fn constants(header: &str) -> Vec<String> {
    header
        .lines()
        .filter_map(|l| l.strip_prefix("#define "))
        .filter_map(|l| l.split_once(' '))
        .map(|(name, _)| name.to_owned())
        .collect()
}

/// A C program that tells the layout as the C compiler sees it.
fn layout_program(header: &str) -> String {
    let mut c = String::from("#include \"toile.h\"\n#include <stdio.h>\nint main(void) {\n");
    for name in constants(header) {
        let _ = writeln!(c, "printf(\"{name} %lld\\n\", (long long){name});");
    }
    for (name, fields) in structs(header) {
        let _ = writeln!(
            c,
            "printf(\"{name} size %zu align %zu\\n\", sizeof({name}), _Alignof({name}));"
        );
        for field in fields {
            let _ = writeln!(
                c,
                "printf(\"{name}.{field} offset %zu size %zu\\n\", offsetof({name}, {field}), \
                 sizeof((({name} *)0)->{field}));"
            );
        }
    }
    c + "return 0;\n}\n"
}

fn layout() -> Option<String> {
    if !support::has("cc") {
        support::skip("cc is not installed");
        return None;
    }
    let folder = std::env::temp_dir().join(format!(
        "toile_abi_{}_{:?}",
        std::process::id(),
        std::thread::current().id()
    ));
    std::fs::create_dir_all(&folder).expect("folder");
    let (source, program) = (folder.join("layout.c"), folder.join("layout"));
    std::fs::write(&source, layout_program(&support::header())).expect("write");
    let built = Command::new("cc")
        .args([
            "-std=c11",
            "-Wall",
            "-Wextra",
            "-Wpedantic",
            "-Werror",
            "-I",
        ])
        .arg(support::root().join("include"))
        .arg(&source)
        .arg("-o")
        .arg(&program)
        .output()
        .expect("cc");
    assert!(
        built.status.success(),
        "{}",
        String::from_utf8_lossy(&built.stderr)
    );
    let told = Command::new(&program).output().expect("run");
    std::fs::remove_dir_all(&folder).expect("clean");
    Some(String::from_utf8(told.stdout).expect("UTF-8"))
}

/// A difference here is a change of the binary interface: append fields, never move them.
#[test]
fn layouts_and_constants_are_the_committed_ones() {
    if let Some(text) = layout() {
        support::compare("tests/golden/abi.txt", &text);
    }
}

#[test]
fn structs_have_no_hidden_padding_and_begin_with_their_size() {
    let Some(text) = layout() else { return };
    let number = |line: &str, key: &str| -> usize {
        let mut words = line.split_whitespace().skip_while(|w| *w != key);
        words.nth(1).expect(key).parse().expect("number")
    };
    let mut count = 0;
    for line in text.lines().filter(|l| l.contains(" align ")) {
        let name = line.split(' ').next().expect("name");
        let fields: Vec<&str> = text
            .lines()
            .filter(|l| l.starts_with(&format!("{name}.")))
            .collect();
        assert_eq!(
            number(line, "size"),
            fields.iter().map(|f| number(f, "size")).sum::<usize>(),
            "{name} has padding"
        );
        assert!(fields[0].starts_with(&format!("{name}.struct_size offset 0 size 8")));
        count += 1;
    }
    assert!(count >= 12);
}

#[test]
fn both_sides_see_the_same_sizes() {
    use toile::capi::*;
    let Some(text) = layout() else { return };
    let mut listed = 0;
    macro_rules! same {
        ($($name:ident),*) => {$(
            let line = format!("{} size {} align {}\n", stringify!($name), size_of::<$name>(), align_of::<$name>());
            assert!(text.contains(&line), "{line}");
            listed += 1;
        )*};
    }
    same!(
        toile_garment_desc,
        toile_panel_desc,
        toile_seam_desc,
        toile_sdf_grid_desc,
        toile_sim_desc,
        toile_contact_desc,
        toile_progress,
        toile_drape_desc,
        toile_step_report,
        toile_energies,
        toile_system_info,
        toile_yarn_changes,
        toile_suggest_desc,
        toile_suggestion,
        toile_view_f64
    );
    assert_eq!(
        listed,
        text.lines().filter(|l| l.contains(" align ")).count()
    );
}
