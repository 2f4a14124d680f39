//! Text to the terminal and failures with their exit codes. A closed pipe ends output quietly.

use std::io::Write;
use std::path::Path;
use std::process::ExitCode;
use toile::error::{Error, Status};

/// Why the program ends with a code other than 0.
pub(crate) struct Failure {
    pub(crate) code: u8,
    pub(crate) text: String,
}

pub(crate) type Done = Result<ExitCode, Failure>;

impl From<Error> for Failure {
    fn from(e: Error) -> Self {
        let code = match e.status {
            Status::NoAdmissibleState | Status::LinearSolve | Status::Panic => 3,
            _ => 1,
        };
        Self {
            code,
            text: e.message,
        }
    }
}

/// Marks an error as one of writing a result.
pub(crate) fn not_written(e: Error) -> Failure {
    Failure {
        code: 4,
        text: e.message,
    }
}

/// Prints to standard output.
pub(crate) fn out(text: &str) -> Done {
    let mut stdout = std::io::stdout().lock();
    match stdout
        .write_all(text.as_bytes())
        .and_then(|()| stdout.flush())
    {
        Err(e) if e.kind() != std::io::ErrorKind::BrokenPipe => Err(Failure {
            code: 4,
            text: format!("standard output: {e}"),
        }),
        _ => Ok(ExitCode::SUCCESS),
    }
}

/// Prints to standard error, come what may.
pub(crate) fn err(text: &str) {
    let _ = std::io::stderr().lock().write_all(text.as_bytes());
}

/// Writes a result file.
pub(crate) fn file(path: &Path, bytes: &[u8]) -> Result<(), Failure> {
    toile::readout::export::write(path, bytes).map_err(not_written)
}
