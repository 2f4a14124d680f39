//! Where an archive keeps the binary of a platform, in FMI 3.0 and in FMI 2.0.

use crate::error::{Error, Result};

/// Version of FMI.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Version {
    /// 2.0
    Two,
    /// 3.0
    Three,
}

/// A platform: its name in FMI 3.0 and, where it has one, in FMI 2.0; ending of libraries.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Platform {
    /// FMI 3.0: architecture and system.
    pub name: &'static str,
    fmi2: Option<&'static str>,
    ending: &'static str,
}

const PLATFORMS: &[Platform] = &[
    Platform {
        name: "x86_64-linux",
        fmi2: Some("linux64"),
        ending: "so",
    },
    Platform {
        name: "aarch64-linux",
        fmi2: None,
        ending: "so",
    },
    Platform {
        name: "x86_64-darwin",
        fmi2: Some("darwin64"),
        ending: "dylib",
    },
    Platform {
        name: "aarch64-darwin",
        fmi2: None,
        ending: "dylib",
    },
    Platform {
        name: "x86_64-windows",
        fmi2: Some("win64"),
        ending: "dll",
    },
];

impl Platform {
    /// By its name in FMI 3.0.
    pub fn named(name: &str) -> Result<Self> {
        let found = PLATFORMS.iter().find(|p| p.name == name);
        found.copied().ok_or_else(|| {
            let names: Vec<&str> = PLATFORMS.iter().map(|p| p.name).collect();
            Error::argument(format!("platform '{name}' is none of {}", names.join(", ")))
        })
    }

    /// The one that this program was built for.
    pub fn own() -> Result<Self> {
        let system = match std::env::consts::OS {
            "macos" => "darwin",
            other => other,
        };
        Self::named(&format!("{}-{system}", std::env::consts::ARCH))
    }

    /// Name of the library as cargo builds it.
    pub fn library(&self) -> String {
        match self.ending {
            "dll" => "toile.dll".into(),
            ending => format!("libtoile.{ending}"),
        }
    }

    /// The binary's place in an archive.
    pub fn member(&self, version: Version, identifier: &str) -> Result<String> {
        let folder = match version {
            Version::Three => self.name,
            Version::Two => self.fmi2.ok_or_else(|| {
                Error::unsupported(format!("FMI 2.0 has no name for {}", self.name))
            })?,
        };
        Ok(format!("binaries/{folder}/{identifier}.{}", self.ending))
    }
}
