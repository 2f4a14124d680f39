//! The command line.

use clap::builder::PossibleValuesParser;
use clap::{Args, Parser, Subcommand};
use std::path::PathBuf;
use toile::indicate::indicator::CRITERIA;

/// Sews, drapes and moves garments.
#[derive(Parser)]
#[command(
    version,
    after_help = "Exit codes: 0 done; 1 scene refused or problems found; 2 wrong command line; \
                  3 no admissible state found; 4 a result could not be written; \
                  5 a drape did not come to rest (results are written, outcome says why)."
)]
pub(crate) struct Cli {
    #[command(subcommand)]
    pub(crate) command: Command,
}

#[derive(Subcommand)]
pub(crate) enum Command {
    /// Drapes and runs a scene; writes summary, models, pattern and a picture.
    Run(RunArgs),
    /// Builds a scene and prints what it costs in unknowns and bytes.
    Info(SceneArgs),
    /// Lists every problem of a scene with its place; exit code 1 if there are any.
    Check(SceneArgs),
    /// Packs a scene into an FMU that masters of FMI 3.0 or 2.0 load.
    Fmu(FmuArgs),
    /// Prints every key of scene files: type, unit, default, meaning.
    Schema {
        /// As a JSON Schema document (draft 2020-12).
        #[arg(long)]
        json: bool,
    },
    /// Writes the mannequin that comes with toile as an OBJ file.
    Mannequin {
        /// File to write.
        out: PathBuf,
        /// Cell of its distance field [m]; 0 chooses.
        #[arg(long, default_value_t = 0.0)]
        cell: f64,
    },
    /// Lays the yarns of a scene's fabrics on the flat panels, draws them and prints what there is.
    Yarns {
        #[command(flatten)]
        scene: SceneArgs,
        /// SVG file to write.
        #[arg(long, value_name = "SVG")]
        out: PathBuf,
    },
    /// Tests a periodic cell of a fabric of yarns: its size at rest, and the material of triangles that is like it.
    Fabric(FabricArgs),
    /// Drapes a scene with blend regions by several models and compares them: error against time.
    Report {
        #[command(flatten)]
        scene: SceneArgs,
        /// Folder for report.json, report.csv and report.html; made if it is not there.
        #[arg(long, value_name = "DIR")]
        out: PathBuf,
    },
    /// Drapes a scene by triangles alone and suggests where yarns would change the answer, and what they would cost.
    Suggest(SuggestArgs),
    /// Draws model files: front, side and back beside each other, y up.
    Picture {
        /// Garment (OBJ, metres); each connected piece gets its own colour.
        garment: PathBuf,
        /// Body to draw with it (OBJ); may be given several times.
        #[arg(long, value_name = "BODY.obj")]
        body: Vec<PathBuf>,
        /// Factor from the body files' coordinates to metres.
        #[arg(long, value_name = "FACTOR", default_value_t = 1.0)]
        body_scale: f64,
        /// PNG file to write.
        #[arg(long, value_name = "PNG")]
        out: PathBuf,
        /// Width and height of the picture [pixel].
        #[arg(long, value_name = "WIDTHxHEIGHT", value_parser = size)]
        size: Option<[usize; 2]>,
    },
}

/// What to read.
#[derive(Args)]
pub(crate) struct SceneArgs {
    /// Scene file, toile garment file or GarmentCode specification (JSON).
    pub(crate) scene: PathBuf,
    /// Closed body mesh in metres (OBJ), added to the scene's bodies.
    #[arg(long, value_name = "BODY.obj")]
    pub(crate) body: Option<PathBuf>,
    /// Factor from the body file's coordinates to metres.
    #[arg(long, value_name = "FACTOR", default_value_t = 1.0)]
    pub(crate) body_scale: f64,
    /// Where the body's origin stands [m]. Garment files place their panels around the body that they
    /// were drawn for; another body may have its origin elsewhere.
    #[arg(long, value_name = "X,Y,Z", value_parser = offset, requires = "body", allow_hyphen_values = true)]
    pub(crate) body_offset: Option<[f64; 3]>,
    /// Target edge length of every panel [m].
    #[arg(long, value_name = "M")]
    pub(crate) edge_length: Option<f64>,
    /// Worker threads, by default as the scene says, else one for each core; results do not depend
    /// on it.
    #[arg(long, value_name = "N")]
    pub(crate) threads: Option<u32>,
    /// Sets a number by dotted name; `toile schema` lists the names.
    #[arg(long = "set", value_name = "NAME=VALUE", value_parser = assignment)]
    pub(crate) set: Vec<(String, f64)>,
}

/// What to test.
#[derive(Args)]
pub(crate) struct FabricArgs {
    /// Fabric file (JSON) with yarns.
    pub(crate) fabric: PathBuf,
    /// Folder for fabric.json, the fabric with the material found, and plots; made if it is not there.
    #[arg(long, value_name = "DIR")]
    pub(crate) out: Option<PathBuf>,
    /// Largest Green strain along the yarns; by default 0.01 for a weave, 0.1 for a knit.
    #[arg(long, value_name = "STRAIN")]
    pub(crate) stretch: Option<f64>,
    /// Largest strain of a direction that is pressed together, 0 for no such tests; by default 0 for a weave, 0.1 for a knit.
    #[arg(long, value_name = "STRAIN")]
    pub(crate) press: Option<f64>,
    /// Largest shear strain, by default 0.1.
    #[arg(long, value_name = "STRAIN")]
    pub(crate) shear: Option<f64>,
    /// Largest curvature [1/m], by default 0.15 over the pitch.
    #[arg(long, value_name = "1/M")]
    pub(crate) curvature: Option<f64>,
    /// Steps to the largest of each, by default 4 for a weave, 20 for a knit.
    #[arg(long, value_name = "N")]
    pub(crate) steps: Option<usize>,
}

/// Which region to suggest.
#[derive(Args)]
pub(crate) struct SuggestArgs {
    #[command(flatten)]
    pub(crate) scene: SceneArgs,
    /// Error of the deformation's gradient, as a root mean square around a vertex, above which triangles give way to yarns, 0.001 to 1000.
    #[arg(long, value_name = "T", required_unless_present_any = ["budget", "compare"])]
    pub(crate) tolerance: Option<f64>,
    /// Most nodes of yarns.
    #[arg(long, value_name = "N")]
    pub(crate) budget: Option<u64>,
    /// Hybrid rings around the region, 0 to 3; by default 0, with --compare as many as the scene's regions have.
    #[arg(long, value_name = "N")]
    pub(crate) rings: Option<u32>,
    /// Leaves a criterion out of the error; may be given several times.
    #[arg(long, value_name = "CRITERION", value_parser = PossibleValuesParser::new(CRITERIA))]
    pub(crate) without: Vec<String>,
    /// How much of the scene's run is judged [s], by default all: the error of a vertex is the largest after any of its steps. 0 judges
    /// the drape alone.
    #[arg(long, value_name = "SECONDS")]
    pub(crate) until: Option<f64>,
    /// Also drapes the scene's own regions, the suggested ones, and yarns everywhere, compares them at rest, and writes report.json, report.csv
    /// and report.html. Without tolerance and budget the suggested ones have no more nodes than the scene's own.
    #[arg(long, conflicts_with = "until")]
    pub(crate) compare: bool,
    /// Width and height of the picture [pixel].
    #[arg(long, value_name = "WIDTHxHEIGHT", value_parser = size)]
    pub(crate) picture_size: Option<[usize; 2]>,
    /// Folder for region.json, garment.json and a picture of the error; made if it is not there.
    #[arg(long, value_name = "DIR")]
    pub(crate) out: PathBuf,
}

/// How to run.
#[derive(Args)]
pub(crate) struct RunArgs {
    #[command(flatten)]
    pub(crate) scene: SceneArgs,
    /// Folder for the results; made if it is not there.
    #[arg(long, value_name = "DIR")]
    pub(crate) out: PathBuf,
    /// Neither progress nor table.
    #[arg(long)]
    pub(crate) quiet: bool,
    /// Width and height of the picture [pixel].
    #[arg(long, value_name = "WIDTHxHEIGHT", value_parser = size)]
    pub(crate) picture_size: Option<[usize; 2]>,
    /// Simulates one further second and reports the largest motion in it.
    #[arg(long)]
    pub(crate) verify: bool,
}

/// How to pack an FMU.
#[derive(Args)]
pub(crate) struct FmuArgs {
    #[command(flatten)]
    pub(crate) scene: SceneArgs,
    /// Archive to write; the model is named after it.
    #[arg(short, long, value_name = "FMU")]
    pub(crate) out: PathBuf,
    /// Version of FMI: 3 or 2.
    #[arg(long, value_name = "2|3", default_value_t = 3, value_parser = clap::value_parser!(u8).range(2..=3))]
    pub(crate) fmi: u8,
    /// libtoile for a platform, such as aarch64-linux=libtoile.so; may be given several times. By
    /// default the one beside this program, for the platform of this program.
    #[arg(long, value_name = "PLATFORM=FILE", value_parser = library)]
    pub(crate) library: Vec<(String, PathBuf)>,
    /// FMU of the same scene, made on another platform, whose binaries are taken in as well; may be
    /// given several times.
    #[arg(long, value_name = "FMU")]
    pub(crate) merge: Vec<PathBuf>,
    /// Begins with the placed panels even if the scene says to drape.
    #[arg(long)]
    pub(crate) no_drape: bool,
    /// No progress.
    #[arg(long)]
    pub(crate) quiet: bool,
}

fn offset(text: &str) -> Result<[f64; 3], String> {
    let numbers: Option<Vec<f64>> = text
        .split(',')
        .map(|n| n.trim().parse().ok().filter(|v: &f64| v.is_finite()))
        .collect();
    numbers
        .and_then(|n| n.try_into().ok())
        .ok_or_else(|| format!("'{text}' is not X,Y,Z: three numbers"))
}

fn size(text: &str) -> Result<[usize; 2], String> {
    let numbers = text.split_once('x').map(|(w, h)| [w.parse(), h.parse()]);
    match numbers {
        Some([Ok(width), Ok(height)]) => Ok([width, height]),
        _ => Err(format!("'{text}' is not WIDTHxHEIGHT, such as 800x600")),
    }
}

fn library(text: &str) -> Result<(String, PathBuf), String> {
    let (platform, file) = text
        .split_once('=')
        .ok_or_else(|| format!("'{text}' is not PLATFORM=FILE"))?;
    Ok((platform.to_owned(), PathBuf::from(file)))
}

fn assignment(text: &str) -> Result<(String, f64), String> {
    let (name, value) = text
        .split_once('=')
        .ok_or_else(|| format!("'{text}' is not NAME=VALUE"))?;
    let value = value
        .trim()
        .parse()
        .map_err(|_| format!("'{value}' is not a number"))?;
    Ok((name.trim().to_owned(), value))
}
