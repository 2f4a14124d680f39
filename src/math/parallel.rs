//! Parallel loops whose result does not depend on the number of threads.
//!
//! Work is cut into chunks of a fixed length; every chunk writes only its own slots; whatever is
//! reduced is reduced afterwards in chunk order. A `Workers` owns its threads and joins them when
//! it is dropped, so that a host may unload the library afterwards.

use rayon::prelude::*;
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;

/// A fixed set of worker threads, or none (everything runs on the caller's thread). Clones share the
/// threads.
#[derive(Clone, Default)]
pub struct Workers {
    team: Option<Arc<Team>>,
}

struct Team {
    /// `None` only while the threads are joined.
    pool: Option<rayon::ThreadPool>,
    handles: Arc<Mutex<Vec<JoinHandle<()>>>>,
}

impl std::fmt::Debug for Workers {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Workers({})", self.count())
    }
}

impl Workers {
    /// `count` threads; 0 or 1, or a refusal of the operating system, means the caller's thread.
    pub fn new(count: usize) -> Self {
        if count <= 1 {
            return Self { team: None };
        }
        let handles = Arc::new(Mutex::new(Vec::new()));
        let owned = Arc::clone(&handles);
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(count)
            .spawn_handler(move |thread| {
                let handle = std::thread::Builder::new()
                    .name("toile-worker".into())
                    .spawn(|| thread.run())?;
                if let Ok(mut list) = owned.lock() {
                    list.push(handle);
                }
                Ok(())
            })
            .build()
            .ok();
        let team = Team { pool, handles };
        Self {
            team: team.pool.is_some().then(|| Arc::new(team)),
        }
    }

    fn pool(&self) -> Option<&rayon::ThreadPool> {
        self.team.as_ref().and_then(|team| team.pool.as_ref())
    }

    /// Runs `f` on one of the threads: the loops within it start without a hand-over to another one.
    pub fn install<R: Send>(&self, f: impl FnOnce() -> R + Send) -> R {
        match self.pool() {
            Some(pool) => pool.install(f),
            None => f(),
        }
    }

    /// Number of threads that a loop runs on.
    pub fn count(&self) -> usize {
        self.pool()
            .map_or(1, rayon::ThreadPool::current_num_threads)
    }

    /// Calls `f(chunk_index, chunk)` for consecutive chunks of `chunk` elements of `data`.
    pub fn chunks<T: Send, F>(&self, data: &mut [T], chunk: usize, f: F)
    where
        F: Fn(usize, &mut [T]) + Sync + Send,
    {
        let chunk = chunk.max(1);
        match self.pool() {
            Some(pool) if data.len() > chunk => pool.install(|| {
                data.par_chunks_mut(chunk)
                    .enumerate()
                    .for_each(|(i, c)| f(i, c));
            }),
            _ => data
                .chunks_mut(chunk)
                .enumerate()
                .for_each(|(i, c)| f(i, c)),
        }
    }

    /// The same with two arrays, cut into the same number of chunks.
    pub fn chunks_of_two<T: Send, U: Send, F>(
        &self,
        (a, chunk_a): (&mut [T], usize),
        (b, chunk_b): (&mut [U], usize),
        f: F,
    ) where
        F: Fn(usize, &mut [T], &mut [U]) + Sync + Send,
    {
        let (chunk_a, chunk_b) = (chunk_a.max(1), chunk_b.max(1));
        match self.pool() {
            Some(pool) if a.len() > chunk_a => pool.install(|| {
                a.par_chunks_mut(chunk_a)
                    .zip(b.par_chunks_mut(chunk_b))
                    .enumerate()
                    .for_each(|(i, (a, b))| f(i, a, b));
            }),
            _ => a
                .chunks_mut(chunk_a)
                .zip(b.chunks_mut(chunk_b))
                .enumerate()
                .for_each(|(i, (a, b))| f(i, a, b)),
        }
    }

    /// Sum of `f(i)` for `i < count`, added in a fixed order whatever the number of threads.
    pub fn sum<F>(&self, count: usize, f: F) -> f64
    where
        F: Fn(usize) -> f64 + Sync + Send,
    {
        const CHUNK: usize = 1024;
        let part = |c: usize| (c * CHUNK..((c + 1) * CHUNK).min(count)).map(&f).sum();
        if self.pool().is_none() {
            return (0..count.div_ceil(CHUNK)).map(part).sum();
        }
        let mut partial = vec![0.0; count.div_ceil(CHUNK)];
        self.chunks(&mut partial, 1, |c, out| {
            out[0] = part(c);
        });
        partial.iter().sum()
    }
}

impl Drop for Team {
    fn drop(&mut self) {
        drop(self.pool.take());
        if let Ok(mut list) = self.handles.lock() {
            for handle in list.drain(..) {
                let _ = handle.join();
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sums_are_bitwise_equal_for_any_thread_count() {
        let f = |i: usize| ((i as f64) * 0.37).sin() * 1e3_f64.powi((i % 7) as i32);
        let one = Workers::new(1).sum(10_000, f);
        for threads in [2, 3, 5] {
            assert_eq!(
                one.to_bits(),
                Workers::new(threads).sum(10_000, f).to_bits()
            );
        }
    }
}
