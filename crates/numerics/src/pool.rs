//! Memory used again and again: a page that the system hands out anew costs more than what is computed on it.

use std::collections::BTreeMap;
use std::ops::{Deref, DerefMut};
use std::sync::{Mutex, PoisonError};

/// Buffers given back, for the next ones of about their size.
#[derive(Debug, Default)]
pub(super) struct Pool {
    /// By length.
    free: Mutex<BTreeMap<usize, Vec<Vec<f64>>>>,
}

/// Shorter ones are left to the allocator, which keeps them itself.
const SHORTEST: usize = 1 << 12;

/// Numbers on loan from a pool.
#[derive(Debug)]
pub(super) struct Buffer<'p> {
    pool: &'p Pool,
    values: Vec<f64>,
    length: usize,
}

impl Pool {
    /// Holds numbers of earlier use.
    pub fn uninitialised(&self, length: usize) -> Buffer<'_> {
        Buffer {
            pool: self,
            values: self.find(length).unwrap_or_else(|| vec![0.0; length]),
            length,
        }
    }

    pub fn zeros(&self, length: usize) -> Buffer<'_> {
        let values = match self.find(length) {
            Some(mut values) => {
                values[..length].fill(0.0);
                values
            }
            None => vec![0.0; length],
        };
        Buffer {
            pool: self,
            values,
            length,
        }
    }

    /// A buffer at most twice as long. Where there is none, as much memory as a new one will take goes
    /// back to the system first, so that what lies idle here does not add to it.
    fn find(&self, length: usize) -> Option<Vec<f64>> {
        if length < SHORTEST {
            return None;
        }
        let mut free = self.free.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((&key, _)) = free.range(length..=2 * length).next() {
            return pop(&mut free, key);
        }
        let mut returned = 0;
        while returned < length
            && let Some((&key, _)) = free.range(..length).next_back()
        {
            returned += pop(&mut free, key).map_or(0, |values| values.len());
        }
        None
    }
}

fn pop(free: &mut BTreeMap<usize, Vec<Vec<f64>>>, key: usize) -> Option<Vec<f64>> {
    let same = free.get_mut(&key)?;
    let values = same.pop();
    if same.is_empty() {
        free.remove(&key);
    }
    values
}

impl Drop for Buffer<'_> {
    fn drop(&mut self) {
        if self.values.len() >= SHORTEST {
            let values = std::mem::take(&mut self.values);
            let mut free = self
                .pool
                .free
                .lock()
                .unwrap_or_else(PoisonError::into_inner);
            free.entry(values.len()).or_default().push(values);
        }
    }
}

impl Deref for Buffer<'_> {
    type Target = [f64];
    fn deref(&self) -> &[f64] {
        &self.values[..self.length]
    }
}

impl DerefMut for Buffer<'_> {
    fn deref_mut(&mut self) -> &mut [f64] {
        &mut self.values[..self.length]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_buffer_comes_back_and_zeros_are_zero() {
        let pool = Pool::default();
        let mut first = pool.uninitialised(3 * SHORTEST);
        first.fill(7.0);
        let place = first.as_ptr();
        drop(first);
        // Too long for a third of it.
        assert!(pool.uninitialised(SHORTEST).iter().all(|v| *v == 0.0));
        let second = pool.uninitialised(2 * SHORTEST);
        assert_eq!((second.as_ptr(), second.len()), (place, 2 * SHORTEST));
        drop(second);
        assert!(pool.zeros(2 * SHORTEST).iter().all(|v| *v == 0.0));
        // What is too short goes back to the system before more is asked for.
        let _longer = pool.uninitialised(4 * SHORTEST);
        assert!(pool.free.lock().unwrap().is_empty());
    }
}
