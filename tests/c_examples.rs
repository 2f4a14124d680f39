//! Every program of `examples_c/` compiles without a warning and holds its laws: plain, under the
//! sanitizers, one under valgrind; CMake and pkg-config find an installed library.
#![allow(clippy::expect_used, reason = "a test may panic")]

use crate::capi_support as support;
use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use std::process::Command;

/// A folder that goes when the test ends.
struct Scratch(PathBuf);

impl Scratch {
    fn new(name: &str) -> Self {
        let folder = std::env::temp_dir().join(format!("toile_{name}_{}", std::process::id()));
        std::fs::create_dir_all(&folder).expect("folder");
        Self(folder)
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

fn examples() -> Vec<PathBuf> {
    let mut found: Vec<PathBuf> = std::fs::read_dir(support::root().join("examples_c"))
        .expect("examples_c")
        .map(|e| e.expect("entry").path())
        .filter(|p| matches!(p.extension().and_then(OsStr::to_str), Some("c" | "cpp")))
        .collect();
    found.sort();
    assert!(found.len() >= 10, "{found:?}");
    found
}

const SANITIZE: [&str; 4] = [
    "-fsanitize=address,undefined",
    "-fno-sanitize-recover=all",
    "-fno-omit-frame-pointer",
    "-g",
];

/// Compiles with every warning an error; the name of the program.
fn compile(compilers: [&str; 2], source: &Path, folder: &Path, extra: &[&str]) -> PathBuf {
    let is_cpp = source.extension() == Some(OsStr::new("cpp"));
    let (compiler, standard) = match is_cpp {
        true => (compilers[1], "-std=c++17"),
        false => (compilers[0], "-std=c11"),
    };
    let program = folder.join(source.file_stem().expect("name"));
    let library = support::library_dir();
    let built = Command::new(compiler)
        .args([standard, "-O1", "-Wall", "-Wextra", "-Wpedantic", "-Werror"])
        .args(extra)
        .arg("-I")
        .arg(support::root().join("include"))
        .arg(source)
        .arg("-o")
        .arg(&program)
        .arg("-L")
        .arg(library)
        .args(["-ltoile", "-lm", "-lpthread"])
        .arg(format!("-Wl,-rpath,{}", library.display()))
        .output()
        .expect(compiler);
    assert!(
        built.status.success(),
        "{compiler} {}: {}",
        source.display(),
        String::from_utf8_lossy(&built.stderr)
    );
    program
}

/// What a program is called with: `03_drape` takes files.
fn arguments(program: &Path, folder: &Path) -> Vec<PathBuf> {
    if program.file_stem() != Some(OsStr::new("03_drape")) {
        return Vec::new();
    }
    let (garment, body) = (folder.join("tunic.json"), folder.join("capsule.obj"));
    std::fs::write(&garment, support::scene::tunic().json()).expect("write");
    std::fs::write(&body, support::scene::capsule_obj(0.3, 0.12)).expect("write");
    vec![garment, body, folder.join("out.obj")]
}

fn run(mut command: Command, program: &Path, folder: &Path) -> String {
    let output = command
        .args(arguments(program, folder))
        .env("RUST_BACKTRACE", "0")
        .output()
        .expect("run");
    let told = format!(
        "{}{}",
        String::from_utf8_lossy(&output.stdout),
        String::from_utf8_lossy(&output.stderr)
    );
    assert!(
        output.status.success(),
        "{} ended with {}: {told}",
        program.display(),
        output.status
    );
    told
}

fn all(compilers: [&str; 2], name: &str, extra: &[&str]) {
    for compiler in compilers {
        if !support::has(compiler) {
            return support::skip(&format!("{compiler} is not installed"));
        }
    }
    let scratch = Scratch::new(name);
    for source in examples() {
        let program = compile(compilers, &source, &scratch.0, extra);
        let told = run(Command::new(&program), &program, &scratch.0);
        println!("{}\n{told}", source.display());
    }
}

#[test]
fn examples_hold_their_laws_compiled_by_gcc() {
    all(["gcc", "g++"], "gcc", &[]);
}

#[test]
fn examples_hold_their_laws_compiled_by_clang() {
    all(["clang", "clang++"], "clang", &[]);
}

#[test]
fn examples_are_clean_under_address_and_undefined_behaviour_sanitizers() {
    all(["gcc", "g++"], "sanitized", &SANITIZE);
}

/// A check that is silently off is worse than none: a program with a fault must be caught.
#[test]
fn sanitizers_are_really_on() {
    if !support::has("gcc") {
        return support::skip("gcc is not installed");
    }
    let scratch = Scratch::new("fault");
    let source = scratch.0.join("fault.c");
    let text = "#include \"toile.h\"\n#include <stdlib.h>\n\
        int main(void) { volatile double *x = malloc(3 * sizeof *x); size_t n = 0; toile_garment *g = NULL;\n\
        toile_garment_create(NULL, &g); free((void *)x);\n\
        toile_garment_to_svg(g, 0, NULL, 0, &n); return x[1] > 1e300; }\n";
    std::fs::write(&source, text).expect("write");
    let mut extra = SANITIZE.to_vec();
    extra.push("-Wno-use-after-free");
    let program = compile(["gcc", "g++"], &source, &scratch.0, &extra);
    let output = Command::new(&program).output().expect("run");
    assert!(!output.status.success());
    let told = String::from_utf8_lossy(&output.stderr);
    assert!(told.contains("heap-use-after-free"), "{told}");
}

#[test]
fn hello_is_clean_under_valgrind() {
    if !support::has("valgrind") || !support::has("gcc") {
        return support::skip("valgrind or gcc is not installed");
    }
    let scratch = Scratch::new("valgrind");
    let source = support::root().join("examples_c/01_hello.c");
    let program = compile(["gcc", "g++"], &source, &scratch.0, &["-g"]);
    let mut command = Command::new("valgrind");
    command
        .args(["--quiet", "--error-exitcode=9", "--leak-check=full"])
        .args(["--errors-for-leak-kinds=definite,indirect,possible"])
        .arg(&program);
    run(command, &program, &scratch.0);
}

#[test]
fn header_is_clean_in_every_standard() {
    let cases: [(&str, &str, &[&str]); 2] = [
        ("gcc", "c", &["c99", "c11", "c17", "c2x"]),
        ("g++", "c++", &["c++11", "c++14", "c++17", "c++20"]),
    ];
    let scratch = Scratch::new("standards");
    let source = scratch.0.join("include.txt");
    std::fs::write(
        &source,
        "#include \"toile.h\"\nint main(void) { return 0; }\n",
    )
    .expect("write");
    for (compiler, language, standards) in cases {
        if !support::has(compiler) {
            return support::skip(&format!("{compiler} is not installed"));
        }
        for standard in standards {
            let output = Command::new(compiler)
                .args(["-x", language, &format!("-std={standard}")])
                .args([
                    "-Wall",
                    "-Wextra",
                    "-Wpedantic",
                    "-Werror",
                    "-fsyntax-only",
                    "-I",
                ])
                .arg(support::root().join("include"))
                .arg(&source)
                .output()
                .expect(compiler);
            assert!(
                output.status.success(),
                "{standard}: {}",
                String::from_utf8_lossy(&output.stderr)
            );
        }
    }
}

/// Installs into a folder of the test's own.
fn install(prefix: &Path) {
    support::library_dir();
    let output = Command::new("bash")
        .arg(support::root().join("scripts/install.sh"))
        .arg(prefix)
        .env("TOILE_LIBRARY_DIR", support::library_dir())
        .output()
        .expect("bash");
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
}

fn succeeds(command: &mut Command) -> String {
    let output = command.output().expect("start");
    let told = format!(
        "{}{}",
        String::from_utf8_lossy(&output.stdout),
        String::from_utf8_lossy(&output.stderr)
    );
    assert!(output.status.success(), "{command:?}: {told}");
    String::from_utf8_lossy(&output.stdout).into_owned()
}

#[test]
fn installed_library_is_found_by_pkg_config() {
    for tool in ["pkg-config", "gcc"] {
        if !support::has(tool) {
            return support::skip(&format!("{tool} is not installed"));
        }
    }
    let scratch = Scratch::new("pkg_config");
    let prefix = scratch.0.join("usr");
    install(&prefix);
    let folder = prefix.join("lib/pkgconfig");
    let version = succeeds(
        Command::new("pkg-config")
            .args(["--modversion", "toile"])
            .env("PKG_CONFIG_PATH", &folder),
    );
    assert_eq!(version.trim(), env!("CARGO_PKG_VERSION"));
    let flags = succeeds(
        Command::new("pkg-config")
            .args(["--cflags", "--libs", "toile"])
            .env("PKG_CONFIG_PATH", &folder),
    );
    let program = scratch.0.join("hello");
    succeeds(
        Command::new("gcc")
            .arg(support::root().join("examples_c/01_hello.c"))
            .arg("-o")
            .arg(&program)
            .args(flags.split_whitespace())
            .arg("-lm"),
    );
    // the program asks for the library by its soname, which must lie beside it
    succeeds(Command::new(&program).env("LD_LIBRARY_PATH", prefix.join("lib")));
    let needed = succeeds(Command::new("readelf").arg("-d").arg(&program));
    assert!(needed.contains("libtoile.so.0"), "{needed}");
}

#[test]
fn installed_library_is_found_by_cmake() {
    for tool in ["cmake", "gcc"] {
        if !support::has(tool) {
            return support::skip(&format!("{tool} is not installed"));
        }
    }
    let scratch = Scratch::new("cmake");
    let prefix = scratch.0.join("usr");
    install(&prefix);
    let text = format!(
        "cmake_minimum_required(VERSION 3.15)\nproject(host C CXX)\n\
         find_package(toile {} REQUIRED)\nset(CMAKE_CXX_STANDARD 17)\n\
         add_executable(host_c \"{root}/examples_c/01_hello.c\")\n\
         target_link_libraries(host_c PRIVATE toile::toile m)\n\
         add_executable(host_cpp \"{root}/examples_c/hello.cpp\")\n\
         target_link_libraries(host_cpp PRIVATE toile::toile)\n",
        env!("CARGO_PKG_VERSION"),
        root = support::root().display()
    );
    std::fs::write(scratch.0.join("CMakeLists.txt"), text).expect("write");
    let build = scratch.0.join("build");
    succeeds(
        Command::new("cmake")
            .arg("-S")
            .arg(&scratch.0)
            .arg("-B")
            .arg(&build)
            .arg(format!("-DCMAKE_PREFIX_PATH={}", prefix.display())),
    );
    succeeds(Command::new("cmake").arg("--build").arg(&build));
    for program in ["host_c", "host_cpp"] {
        succeeds(&mut Command::new(build.join(program)));
    }
}
