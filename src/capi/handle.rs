//! Tables of objects behind handles.
//!
//! A handle is a pointer-sized number `kind << 56 | generation << 32 | slot` that is looked up and
//! never dereferenced. The kind in the top byte makes it an address that no process can have, so a
//! host that mistakes it for one finds out at once. A slot's generation goes up when its object is
//! freed: handles of freed objects never match again. A slot whose generations are used up is not
//! used again.
//!
//! The look-up takes a lock for a few instructions and leaves with a reference count, so that
//! `free` during a call of another thread is safe: the object goes when that call ends.

use super::guard::catch;
use crate::error::{Error, Result, Status};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, RwLock, TryLockError};

const _: () = assert!(usize::BITS == 64, "handles are 64-bit numbers");

const GENERATIONS: u32 = 1 << 24;

/// An object with its use by threads.
#[derive(Debug)]
pub(super) struct Entry<T> {
    object: RwLock<T>,
    poisoned: AtomicBool,
    kind: &'static str,
}

impl<T> Entry<T> {
    /// Runs `f` beside other readers; refused while a writer is at work.
    pub(super) fn read<R>(&self, f: impl FnOnce(&T) -> Result<R>) -> Result<R> {
        match self.object.try_read() {
            Ok(object) => self.run(|| f(&object)),
            Err(TryLockError::WouldBlock) => Err(self.busy("changing")),
            Err(TryLockError::Poisoned(_)) => Err(self.broken()),
        }
    }

    /// Runs `f` alone; refused while anybody else is at work.
    pub(super) fn write<R>(&self, f: impl FnOnce(&mut T) -> Result<R>) -> Result<R> {
        match self.object.try_write() {
            Ok(mut object) => self.run(|| f(&mut object)),
            Err(TryLockError::WouldBlock) => Err(self.busy("using")),
            Err(TryLockError::Poisoned(_)) => Err(self.broken()),
        }
    }

    /// The lock is held: a panic of an earlier holder has left its mark before it let go.
    fn run<R>(&self, f: impl FnOnce() -> Result<R>) -> Result<R> {
        if self.poisoned.load(Ordering::Acquire) {
            return Err(self.broken());
        }
        let result = catch(f);
        if matches!(&result, Err(e) if e.status == Status::Panic) {
            self.poisoned.store(true, Ordering::Release);
        }
        result
    }

    fn busy(&self, what: &str) -> Error {
        Error::new(
            Status::Busy,
            format!("another call is {what} this {}", self.kind),
        )
    }

    fn broken(&self) -> Error {
        Error::new(
            Status::Panic,
            format!(
                "this {} was given up after an internal error; it can only be freed",
                self.kind
            ),
        )
    }
}

#[derive(Debug)]
struct Slot<T> {
    generation: u32,
    entry: Option<Arc<Entry<T>>>,
}

#[derive(Debug)]
struct Slots<T> {
    slots: Vec<Slot<T>>,
    free: Vec<u32>,
}

/// All living objects of one kind.
#[derive(Debug)]
pub(super) struct Table<T> {
    kind: u8,
    name: &'static str,
    inner: Mutex<Slots<T>>,
}

impl<T> Table<T> {
    /// An empty table. Kinds are the top byte of a handle: 1 to 127, one for each table.
    pub(super) const fn new(kind: u8, name: &'static str) -> Self {
        Self {
            kind,
            name,
            inner: Mutex::new(Slots {
                slots: Vec::new(),
                free: Vec::new(),
            }),
        }
    }

    fn lock(&self) -> MutexGuard<'_, Slots<T>> {
        // nothing in this file panics while it holds the lock
        self.inner.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Takes an object in; the result is its handle's number.
    pub(super) fn insert(&self, object: T) -> Result<usize> {
        let entry = Some(Arc::new(Entry {
            object: RwLock::new(object),
            poisoned: AtomicBool::new(false),
            kind: self.name,
        }));
        let mut inner = self.lock();
        let index = match inner.free.pop() {
            Some(index) => {
                inner.slots[index as usize].entry = entry;
                index
            }
            None => {
                let index = u32::try_from(inner.slots.len())
                    .map_err(|_| Error::limit(format!("too many objects: {}", self.name)))?;
                inner.slots.push(Slot {
                    generation: 0,
                    entry,
                });
                index
            }
        };
        let generation = inner.slots[index as usize].generation;
        Ok(usize::from(self.kind) << 56 | (generation as usize) << 32 | index as usize)
    }

    /// Slot number of a handle that belongs to a living object.
    fn find(&self, inner: &Slots<T>, token: usize) -> Result<usize> {
        let refuse = |why: String| Err(Error::new(Status::Handle, why));
        let name = self.name;
        if token == 0 {
            return refuse(format!("the {name} handle is NULL"));
        }
        if token >> 56 != usize::from(self.kind) {
            return refuse(format!("{token:#x} is not the handle of a {name}"));
        }
        let generation = (token >> 32) as u32 & (GENERATIONS - 1);
        let index = token & 0xffff_ffff;
        match inner.slots.get(index) {
            Some(slot) if slot.generation == generation && slot.entry.is_some() => Ok(index),
            Some(_) => refuse(format!("the {name} of handle {token:#x} was freed")),
            None => refuse(format!("{token:#x} is not the handle of a {name}")),
        }
    }

    /// The object of a handle.
    pub(super) fn get(&self, token: usize) -> Result<Arc<Entry<T>>> {
        let inner = self.lock();
        let index = self.find(&inner, token)?;
        inner.slots[index].entry.clone().ok_or_else(|| {
            Error::new(
                Status::Handle,
                format!("the {} of handle {token:#x} was freed", self.name),
            )
        })
    }

    /// Takes an object out; it is destroyed when its last running call ends.
    pub(super) fn remove(&self, token: usize) -> Result<()> {
        let entry = {
            let mut inner = self.lock();
            let index = self.find(&inner, token)?;
            let slot = &mut inner.slots[index];
            let entry = slot.entry.take();
            slot.generation += 1;
            if slot.generation < GENERATIONS {
                inner.free.push(index as u32);
            }
            entry
        };
        // destroyed outside the lock: it may take long
        drop(entry);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn handles_of_freed_objects_never_match_again() {
        let table = Table::new(3, "thing");
        let mut old = Vec::new();
        for i in 0..1000 {
            let token = table.insert(i).unwrap();
            assert!(!old.contains(&token));
            assert_eq!(table.get(token).unwrap().read(|v| Ok(*v)).unwrap(), i);
            table.remove(token).unwrap();
            assert_eq!(table.remove(token).unwrap_err().status, Status::Handle);
            old.push(token);
        }
        assert_eq!(table.lock().slots.len(), 1, "the slot is used again");
        for token in old {
            assert_eq!(table.get(token).unwrap_err().status, Status::Handle);
        }
    }

    #[test]
    fn null_foreign_and_invented_handles_are_refused() {
        let (a, b) = (Table::new(3, "thing"), Table::new(4, "other"));
        let token = a.insert(1).unwrap();
        b.insert(1).unwrap();
        for wrong in [
            0,
            1,
            token + 1,
            usize::MAX,
            token ^ 1 << 40,
            &raw const a as usize,
        ] {
            assert_eq!(a.get(wrong).unwrap_err().status, Status::Handle, "{wrong}");
        }
        assert_eq!(b.get(token).unwrap_err().status, Status::Handle);
    }

    #[test]
    fn a_slot_without_generations_left_is_given_up() {
        let table = Table::new(3, "thing");
        let first = table.insert(0).unwrap();
        table.lock().slots[0].generation = GENERATIONS - 1;
        assert!(table.get(first).is_err());
        let last = first | (GENERATIONS as usize - 1) << 32;
        table.remove(last).unwrap();
        let next = table.insert(0).unwrap();
        assert_eq!(next & 0xffff_ffff, 1);
        assert!(table.get(last).is_err());
    }

    #[test]
    fn a_writer_excludes_everybody_and_readers_exclude_writers() {
        let table = Table::new(3, "thing");
        let entry = table.get(table.insert(5).unwrap()).unwrap();
        entry
            .write(|_| {
                assert_eq!(entry.read(|_| Ok(())).unwrap_err().status, Status::Busy);
                assert_eq!(entry.write(|_| Ok(())).unwrap_err().status, Status::Busy);
                Ok(())
            })
            .unwrap();
        entry
            .read(|_| {
                entry.read(|_| Ok(())).unwrap();
                assert_eq!(entry.write(|_| Ok(())).unwrap_err().status, Status::Busy);
                Ok(())
            })
            .unwrap();
        entry.write(|_| Ok(())).unwrap();
    }

    #[test]
    fn a_panic_poisons_its_handle_and_no_other() {
        let table = Table::new(3, "thing");
        let (bad, good) = (table.insert(1).unwrap(), table.insert(2).unwrap());
        let panicked: Result<()> = table.get(bad).unwrap().write(|_| panic!("broken"));
        assert_eq!(panicked.unwrap_err().status, Status::Panic);
        for _ in 0..2 {
            let again = table.get(bad).unwrap().read(|v| Ok(*v));
            assert_eq!(again.unwrap_err().status, Status::Panic);
        }
        assert_eq!(table.get(good).unwrap().read(|v| Ok(*v)).unwrap(), 2);
        table.remove(bad).unwrap();
    }

    #[test]
    fn an_object_freed_during_a_call_lives_until_its_end() {
        let table = Table::new(3, "thing");
        let token = table.insert(vec![1, 2, 3]).unwrap();
        let entry = table.get(token).unwrap();
        let sum: i32 = entry
            .read(|v| {
                table.remove(token).unwrap();
                Ok(v.iter().sum())
            })
            .unwrap();
        assert_eq!(sum, 6);
        assert!(table.get(token).is_err());
    }
}
