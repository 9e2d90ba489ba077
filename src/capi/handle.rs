//! Handles: 64-bit ids instead of addresses, so that a released, foreign or mistyped one is an error
//! and never a crash. The look-up is paid per call of the interface, never per ray.
//!
//! An id packs, from the low end: slot (24 bits), generation of the slot (12), kind (4), device (24).
//! Kinds start at 1, so no id is 0, which means "none". Neither generations nor devices come round again.

use super::error::{ERROR_INVALID_HANDLE, ERROR_WRONG_STATE, Failure};
use std::marker::PhantomData;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

const SLOT_BITS: u32 = 24;
const GENERATION_BITS: u32 = 12;
const KIND_BITS: u32 = 4;
/// Of a device's number.
pub(super) const DEVICE_BITS: u32 = 24;

/// What a handle can refer to.
pub trait Kind {
    /// One of the header's object kinds, 1 to 15.
    const KIND: u32;
    /// For messages.
    const NAME: &'static str;
    /// The same, of several.
    const PLURAL: &'static str;
}

/// A handle as it crosses the boundary: C's `struct { uint64_t id; }`, which all supported calling
/// conventions pass as the integer it holds.
#[derive(Debug, PartialEq, Eq)]
#[repr(transparent)]
pub struct Handle<K> {
    id: u64,
    kind: PhantomData<fn() -> K>,
}

impl<K> Clone for Handle<K> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<K> Copy for Handle<K> {}

impl<K> Handle<K> {
    /// The handle with this id, which may be any number.
    pub const fn new(id: u64) -> Handle<K> {
        Handle { id, kind: PhantomData }
    }

    /// Its id.
    pub const fn id(self) -> u64 {
        self.id
    }
}

/// The living objects of one kind of one device.
pub(super) struct Table<T> {
    device: u32,
    slots: Mutex<Slots<T>>,
}

struct Slots<T> {
    slots: Vec<Slot<T>>,
    free: Vec<u32>,
    closed: bool,
}

struct Slot<T> {
    generation: u32,
    object: Option<Arc<T>>,
}

impl<T: Kind> Table<T> {
    pub(super) fn new(device: u32) -> Table<T> {
        Table { device, slots: Mutex::new(Slots { slots: Vec::new(), free: Vec::new(), closed: false }) }
    }

    /// No code of the host runs under this lock and each change is one assignment, so a panic cannot
    /// leave the slots half changed.
    fn lock(&self) -> MutexGuard<'_, Slots<T>> {
        self.slots.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Stores the object that `make` builds for its id.
    pub(super) fn insert(&self, make: impl FnOnce(u64) -> T) -> Result<(Handle<T>, Arc<T>), Failure> {
        let mut table = self.lock();
        if table.closed {
            return Err(Failure::new(ERROR_WRONG_STATE, "the device is being released"));
        }
        let slot = match table.free.pop() {
            Some(slot) => slot,
            None => {
                let slot = table.slots.len() as u32;
                if slot >> SLOT_BITS != 0 {
                    return Err(Failure::limit(T::NAME, format!("handles have run out at {slot}")));
                }
                table.slots.push(Slot { generation: 0, object: None });
                slot
            }
        };
        let entry = &mut table.slots[slot as usize];
        let id = pack(slot, entry.generation, T::KIND, self.device);
        let object = Arc::new(make(id));
        entry.object = Some(object.clone());
        Ok((Handle::new(id), object))
    }

    /// The object, or why there is none.
    pub(super) fn get(&self, handle: Handle<T>) -> Result<Arc<T>, Failure> {
        let slot = self.check(handle)?;
        let table = self.lock();
        table.living(handle.id, slot).cloned().ok_or_else(|| stale::<T>(handle.id))
    }

    /// Takes the object out; its handle is stale from now on.
    pub(super) fn remove(&self, handle: Handle<T>) -> Result<Arc<T>, Failure> {
        let slot = self.check(handle)?;
        let mut table = self.lock();
        if table.living(handle.id, slot).is_none() {
            return Err(stale::<T>(handle.id));
        }
        let entry = &mut table.slots[slot as usize];
        let object = entry.object.take().ok_or_else(|| stale::<T>(handle.id))?;
        entry.generation += 1;
        // A slot whose generations are used up rests for ever, so no id ever comes back.
        if entry.generation >> GENERATION_BITS == 0 {
            table.free.push(slot);
        }
        Ok(object)
    }

    /// Takes all objects out and refuses new ones.
    pub(super) fn close(&self) -> Vec<Arc<T>> {
        let mut table = self.lock();
        table.closed = true;
        table.slots.iter_mut().filter_map(|slot| slot.object.take()).collect()
    }

    /// The slot a handle speaks of, if it can be one of this table.
    fn check(&self, handle: Handle<T>) -> Result<u32, Failure> {
        let id = handle.id;
        let invalid = |text: String| Err(Failure::new(ERROR_INVALID_HANDLE, text).object(T::KIND, id, ""));
        let kind = (id >> (SLOT_BITS + GENERATION_BITS)) as u32 & ((1 << KIND_BITS) - 1);
        if id == 0 {
            return invalid(format!("the {} handle is null", T::NAME));
        }
        if kind != T::KIND {
            return invalid(format!("the handle {id:#x} is not one of a {}", T::NAME));
        }
        if (id >> (SLOT_BITS + GENERATION_BITS + KIND_BITS)) as u32 != self.device {
            return invalid(format!("the {} handle {id:#x} belongs to another device", T::NAME));
        }
        Ok(id as u32 & ((1 << SLOT_BITS) - 1))
    }
}

impl<T: Kind> Slots<T> {
    fn living(&self, id: u64, slot: u32) -> Option<&Arc<T>> {
        let generation = (id >> SLOT_BITS) as u32 & ((1 << GENERATION_BITS) - 1);
        let entry = self.slots.get(slot as usize).filter(|entry| entry.generation == generation)?;
        entry.object.as_ref()
    }
}

/// Of an object that is gone.
pub(super) fn stale<T: Kind>(id: u64) -> Failure {
    Failure::new(ERROR_INVALID_HANDLE, format!("the {} handle {id:#x} was released", T::NAME)).object(T::KIND, id, "")
}

fn pack(slot: u32, generation: u32, kind: u32, device: u32) -> u64 {
    let high = (device as u64) << KIND_BITS | kind as u64;
    (high << GENERATION_BITS | generation as u64) << SLOT_BITS | slot as u64
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Thing;

    impl Kind for Thing {
        const KIND: u32 = 3;
        const NAME: &'static str = "thing";
        const PLURAL: &'static str = "things";
    }

    #[test]
    fn a_handle_finds_its_object_and_no_other_handle_does() {
        let table = Table::new(7);
        let (handle, object) = table.insert(|_| Thing).unwrap();
        assert!(Arc::ptr_eq(&table.get(handle).unwrap(), &object));
        for bit in 0..64 {
            assert!(table.get(Handle::new(handle.id() ^ 1 << bit)).is_err(), "bit {bit}");
        }
        assert!(table.get(Handle::new(0)).is_err());
        assert!(table.get(Handle::new(u64::MAX)).is_err());
    }

    #[test]
    fn a_released_handle_stays_invalid_when_its_slot_is_used_again() {
        let table = Table::new(1);
        let (first, _) = table.insert(|_| Thing).unwrap();
        table.remove(first).unwrap();
        let (second, _) = table.insert(|_| Thing).unwrap();
        assert_eq!(first.id() & 0xff_ffff, second.id() & 0xff_ffff, "the slot is used again");
        assert!(table.get(first).is_err());
        assert!(table.remove(first).is_err());
        assert!(table.get(second).is_ok());
    }

    #[test]
    fn a_slot_rests_when_its_generations_are_used_up() {
        let table = Table::new(1);
        let mut handle = table.insert(|_| Thing).unwrap().0;
        let first = handle;
        for _ in 0..1 << GENERATION_BITS {
            table.remove(handle).unwrap();
            handle = table.insert(|_| Thing).unwrap().0;
        }
        assert_eq!(handle.id() & 0xff_ffff, 1, "a new slot");
        assert!(table.get(first).is_err());
    }

    #[test]
    fn a_closed_table_takes_nothing() {
        let table = Table::new(1);
        table.insert(|_| Thing).unwrap();
        assert_eq!(table.close().len(), 1);
        assert!(table.insert(|_| Thing).is_err());
    }
}
