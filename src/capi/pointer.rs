//! Pointers that come from a host. Each wrapper can only be made by C or by an `unsafe` constructor,
//! whose contract (the rules on the header's first page) is what makes the reads and writes here
//! sound: a pointer is null, or valid for its type during the call. Alignment is not asked for.

use super::error::Failure;
use std::ffi::c_char;
use std::mem::MaybeUninit;

/// Longest name, in bytes, without the terminator.
pub const MAX_NAME: usize = 1023;
/// Longest path, in bytes, without the terminator.
pub const MAX_PATH: usize = 4095;
/// No descriptor of any version is larger; a greater `struct_size` is garbage.
const MAX_STRUCT: usize = 4096;

/// A struct of the header that begins with `uint32_t struct_size`.
///
/// # Safety
/// `repr(C)`, the first field is a `u32`, and every bit pattern is a value.
pub unsafe trait Sized32: Copy {
    /// Its name in the header.
    const NAME: &'static str;
    /// Its size in the first version of the header that had it: nobody can pass less.
    const FIRST_SIZE: usize;
}

/// Reads the size a host wrote at the start of its struct.
fn host_size<T: Sized32>(pointer: *const T, parameter: &'static str) -> Result<usize, Failure> {
    if pointer.is_null() {
        return Err(Failure::argument(parameter, "is null"));
    }
    // SAFETY: not null, so by the wrapper's contract it points to a struct whose first field is this.
    let size = unsafe { pointer.cast::<u32>().read_unaligned() } as usize;
    if size < T::FIRST_SIZE || size > MAX_STRUCT {
        let text = format!("is {size}; sizeof({}) was expected, which is {}", T::NAME, size_of::<T>());
        return Err(Failure::incompatible("struct_size", text));
    }
    Ok(size)
}

/// A descriptor that the host passes in.
#[derive(Clone, Copy)]
#[repr(transparent)]
pub struct In<T>(*const T);

impl<T: Sized32> In<T> {
    /// # Safety
    /// Null, or readable for as many bytes as its `struct_size` says, throughout the call.
    pub unsafe fn new(pointer: *const T) -> In<T> {
        In(pointer)
    }

    /// Whether there is none.
    pub(super) fn is_null(self) -> bool {
        self.0.is_null()
    }

    /// For C's `const T*` that may be null.
    pub(super) fn read_optional(self, parameter: &'static str) -> Result<Option<T>, Failure> {
        if self.0.is_null() { Ok(None) } else { self.read(parameter).map(Some) }
    }

    /// Copies the descriptor. Fields that an older host does not know are zero, which means their
    /// default; fields that this library does not know must be zero.
    pub(super) fn read(self, parameter: &'static str) -> Result<T, Failure> {
        let size = host_size(self.0, parameter)?;
        let mut value = MaybeUninit::<T>::zeroed();
        // SAFETY: `size` bytes are readable by the wrapper's contract; at most `size_of::<T>()` of
        // them are written into `value`, and any bit pattern is a `T`.
        let (value, rest) = unsafe {
            let bytes = self.0.cast::<u8>();
            std::ptr::copy_nonoverlapping(bytes, value.as_mut_ptr().cast::<u8>(), size.min(size_of::<T>()));
            let known = size.min(size_of::<T>());
            (value.assume_init(), std::slice::from_raw_parts(bytes.add(known), size - known))
        };
        if let Some(at) = rest.iter().position(|&b| b != 0) {
            let text =
                format!("{} has a value at byte {}, beyond what this library knows", T::NAME, size_of::<T>() + at);
            return Err(Failure::incompatible(parameter, text));
        }
        Ok(value)
    }
}

/// Where the host wants one value.
#[derive(Clone, Copy)]
#[repr(transparent)]
pub struct Out<T>(*mut T);

impl<T: Copy> Out<T> {
    /// # Safety
    /// Null, or writable throughout the call.
    pub unsafe fn new(pointer: *mut T) -> Out<T> {
        Out(pointer)
    }

    /// Refuses null; called before anything is changed.
    pub(super) fn required(self, parameter: &'static str) -> Result<Out<T>, Failure> {
        if self.0.is_null() { Err(Failure::argument(parameter, "is null")) } else { Ok(self) }
    }

    /// Writes, unless the host passed null.
    pub(super) fn write(self, value: T) {
        if !self.0.is_null() {
            // SAFETY: not null, so writable by the wrapper's contract.
            unsafe { self.0.write_unaligned(value) };
        }
    }
}

/// Where the host wants a struct that carries its size.
#[derive(Clone, Copy)]
#[repr(transparent)]
pub struct OutStruct<T>(*mut T);

/// A checked [`OutStruct`]; null is possible where the header allows it.
pub(super) struct Place<T> {
    pointer: *mut T,
    size: usize,
}

impl<T: Sized32> OutStruct<T> {
    /// # Safety
    /// Null, or readable and writable for as many bytes as its `struct_size` says.
    pub unsafe fn new(pointer: *mut T) -> OutStruct<T> {
        OutStruct(pointer)
    }

    /// For C's `T*` that may not be null.
    pub(super) fn required(self, parameter: &'static str) -> Result<Place<T>, Failure> {
        Ok(Place { pointer: self.0, size: host_size(self.0, parameter)? })
    }

    /// For C's `T*` that may be null.
    pub(super) fn optional(self, parameter: &'static str) -> Result<Place<T>, Failure> {
        if self.0.is_null() { Ok(Place { pointer: self.0, size: 0 }) } else { self.required(parameter) }
    }
}

impl<T: Sized32> Place<T> {
    /// Writes what fits into the host's version of the struct; what only the host knows becomes zero.
    /// The host's `struct_size` stays.
    pub(super) fn write(self, value: &T) {
        if self.pointer.is_null() {
            return;
        }
        let head = size_of::<u32>();
        let known = self.size.min(size_of::<T>());
        // SAFETY: `size` bytes are writable by the contract of `OutStruct`, `known` does not exceed
        // it nor `size_of::<T>()`, and `FIRST_SIZE` is at least `head`.
        unsafe {
            let to = self.pointer.cast::<u8>();
            let from = std::ptr::from_ref(value).cast::<u8>();
            std::ptr::copy_nonoverlapping(from.add(head), to.add(head), known - head);
            std::ptr::write_bytes(to.add(known), 0, self.size - known);
        }
    }
}

/// A fixed number of plain values, such as a transform.
#[derive(Clone, Copy)]
#[repr(transparent)]
pub struct Values<T, const N: usize>(*const T);

impl<T: Copy, const N: usize> Values<T, N> {
    /// # Safety
    /// Null, or readable for `N` values throughout the call.
    pub unsafe fn new(pointer: *const T) -> Values<T, N> {
        Values(pointer)
    }

    /// The values, or nothing for null.
    pub(super) fn read(self) -> Option<[T; N]> {
        // SAFETY: not null, so `N` values are readable by the wrapper's contract.
        (!self.0.is_null()).then(|| unsafe { self.0.cast::<[T; N]>().read_unaligned() })
    }
}

/// A NUL-terminated UTF-8 string.
#[derive(Clone, Copy)]
#[repr(transparent)]
pub struct Text(*const c_char);

impl Text {
    /// No string.
    pub const NULL: Text = Text(std::ptr::null());

    /// # Safety
    /// Null, or a NUL-terminated string that stays as it is throughout the call.
    pub const unsafe fn new(pointer: *const c_char) -> Text {
        Text(pointer)
    }

    /// A copy; null is the empty string.
    pub(super) fn read(self, parameter: &'static str, max: usize) -> Result<String, Failure> {
        if self.0.is_null() {
            return Ok(String::new());
        }
        let mut bytes = Vec::new();
        loop {
            // SAFETY: no byte before this one was the terminator, so the string goes on up to here.
            let byte = unsafe { self.0.cast::<u8>().add(bytes.len()).read() };
            if byte == 0 {
                break;
            }
            if bytes.len() == max {
                return Err(Failure::limit(parameter, format!("is longer than {max} bytes")));
            }
            bytes.push(byte);
        }
        String::from_utf8(bytes).map_err(|error| {
            let at = error.utf8_error().valid_up_to();
            Failure::argument(parameter, "is not UTF-8").at(at as u64)
        })
    }
}

/// Where the host wants a string.
#[derive(Clone, Copy)]
#[repr(transparent)]
pub struct TextOut(*mut c_char);

impl TextOut {
    /// # Safety
    /// Null, or writable for as many bytes as the capacity passed along with it.
    pub const unsafe fn new(pointer: *mut c_char) -> TextOut {
        TextOut(pointer)
    }

    /// Writes what fits and a NUL, as C's `snprintf` does.
    ///
    /// # Safety
    /// Null, or writable for `capacity` bytes.
    pub(super) unsafe fn write(self, text: &str, capacity: u64) {
        if self.0.is_null() || capacity == 0 {
            return;
        }
        let length = text.len().min(usize::try_from(capacity - 1).unwrap_or(usize::MAX));
        // SAFETY: `length` is below `capacity`, and the source has at least so many bytes.
        unsafe {
            std::ptr::copy_nonoverlapping(text.as_ptr(), self.0.cast::<u8>(), length);
            self.0.add(length).write(0);
        }
    }
}

/// Copies `count` elements of `N` values that stand `stride` bytes apart (0: without gaps).
///
/// # Safety
/// `data` is null, or readable for `count` such elements.
pub(super) unsafe fn copy_elements<T: Copy, const N: usize>(
    parameter: &'static str,
    data: *const T,
    count: u64,
    stride: u64,
) -> Result<Vec<[T; N]>, Failure> {
    let element = size_of::<[T; N]>() as u64;
    let stride = if stride == 0 { element } else { stride };
    if stride < element {
        let text = format!("have a stride of {stride} bytes; at least {element} were expected");
        return Err(Failure::argument(parameter, text));
    }
    match (data.is_null(), count) {
        (_, 0) => return Ok(Vec::new()),
        (true, _) => return Err(Failure::argument(parameter, format!("are null, but their count is {count}"))),
        (false, _) => {}
    }
    let too_many = || Failure::limit(parameter, format!("{count} elements do not fit into the address space"));
    // No object in memory is larger than `isize::MAX` bytes.
    let bytes = count.checked_mul(stride).filter(|&b| b <= isize::MAX as u64).ok_or_else(too_many)?;
    let count = usize::try_from(count).map_err(|_| too_many())?;
    let mut elements = Vec::new();
    elements
        .try_reserve_exact(count)
        .map_err(|_| Failure::out_of_memory(parameter, format!("{bytes} bytes could not be allocated")))?;
    for i in 0..count {
        // SAFETY: element `i` is readable by the caller's promise; the offset fits, as checked above.
        elements.push(unsafe { data.cast::<u8>().add(i * stride as usize).cast::<[T; N]>().read_unaligned() });
    }
    Ok(elements)
}
