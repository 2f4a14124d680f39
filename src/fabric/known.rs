//! What is remembered of fabrics while the program runs, since it takes tests of a cell to find.

use crate::error::Result;
use crate::pattern::yarn_fabric::YarnFabric;
use crate::solve::settings::Settings;
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Most fabrics that are remembered.
const REMEMBERED: usize = 64;

/// What a finding is a function of.
type Key = (YarnFabric, Vec<(String, f64)>);

/// Findings by fabric and numbers.
pub(super) struct Known<T>(Mutex<Vec<(Key, T)>>);

impl<T: Clone> Known<T> {
    /// Nothing yet.
    pub(super) const fn new() -> Self {
        Self(Mutex::new(Vec::new()))
    }

    fn list(&self) -> MutexGuard<'_, Vec<(Key, T)>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// What is known of a fabric, or else what `find` tells.
    pub(super) fn of(
        &self,
        yarns: &YarnFabric,
        settings: &Settings,
        find: impl FnOnce() -> Result<T>,
    ) -> Result<T> {
        // it is that of the fabric at rest, however it is laid
        let yarns = YarnFabric {
            compensated: false,
            ..yarns.clone()
        };
        let key = (yarns, settings.that_matter());
        if let Some((_, found)) = self.list().iter().find(|(other, _)| *other == key) {
            return Ok(found.clone());
        }
        let found = find()?;
        let mut list = self.list();
        if list.len() == REMEMBERED {
            list.remove(0);
        }
        list.push((key, found.clone()));
        Ok(found)
    }
}
