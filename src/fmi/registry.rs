//! Tables of what masters hold pointers to: instances and saved states.
//!
//! What a master gets is a number that is looked up and never dereferenced; numbers are never used
//! again. NULL, freed, foreign and invented pointers are found out by the look-up. The tables hold
//! no memory while they are empty, so that nothing is left when the library is unloaded.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

const _: () = assert!(usize::BITS == 64, "tokens are 64-bit numbers");

/// Objects of one kind by token.
#[derive(Debug)]
pub(super) struct Registry<T> {
    kind: usize,
    inner: Mutex<Inner<T>>,
}

#[derive(Debug)]
struct Inner<T> {
    last: usize,
    live: BTreeMap<usize, Arc<T>>,
}

impl<T> Registry<T> {
    /// An empty table; `kind` is the top byte of its tokens, which makes them addresses that no
    /// process has.
    pub(super) const fn new(kind: u8) -> Self {
        Self {
            kind: (kind as usize) << 56,
            inner: Mutex::new(Inner {
                last: 0,
                live: BTreeMap::new(),
            }),
        }
    }

    fn lock(&self) -> MutexGuard<'_, Inner<T>> {
        // nothing here panics while it holds the lock
        self.inner.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Takes an object in.
    pub(super) fn insert(&self, object: T) -> usize {
        let mut inner = self.lock();
        inner.last += 1;
        let token = self.kind | inner.last;
        inner.live.insert(token, Arc::new(object));
        token
    }

    /// The object of a token, if it lives.
    pub(super) fn get(&self, token: usize) -> Option<Arc<T>> {
        self.lock().live.get(&token).cloned()
    }

    /// Puts another object behind a living token.
    pub(super) fn replace(&self, token: usize, object: T) -> bool {
        let old = match self.lock().live.get_mut(&token) {
            Some(slot) => std::mem::replace(slot, Arc::new(object)),
            None => return false,
        };
        drop(old);
        true
    }

    /// Takes an object out; its last user destroys it.
    pub(super) fn remove(&self, token: usize) -> Option<Arc<T>> {
        let mut inner = self.lock();
        let object = inner.live.remove(&token);
        if inner.live.is_empty() {
            // an empty tree may keep its root's memory
            inner.live = BTreeMap::new();
        }
        object
    }

    /// Takes out every object that `which` names.
    pub(super) fn remove_all(&self, which: impl Fn(&T) -> bool) {
        let gone: Vec<usize> = {
            let inner = self.lock();
            let all = inner.live.iter();
            all.filter(|(_, v)| which(v)).map(|(k, _)| *k).collect()
        };
        for token in gone {
            drop(self.remove(token));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tokens_of_removed_objects_never_match_again() {
        let table = Registry::new(0x51);
        let first = table.insert(1);
        assert_eq!(table.get(first).as_deref(), Some(&1));
        assert!(table.replace(first, 5));
        assert_eq!(table.remove(first).as_deref(), Some(&5));
        let second = table.insert(2);
        assert_ne!(first, second);
        for wrong in [0, first, second + 1, usize::MAX, &raw const table as usize] {
            assert!(
                table.get(wrong).is_none() && table.remove(wrong).is_none(),
                "{wrong:#x}"
            );
            assert!(!table.replace(wrong, 9));
        }
        table.remove_all(|v| *v == 2);
        assert!(table.get(second).is_none());
    }
}
