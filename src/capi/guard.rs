//! What surrounds every exported function: the floating-point state, the panic guard, the look-up of
//! the device, the rule about calls from inside callbacks, and the error record. The macro [`export`]
//! is the only place that makes a symbol; a test counts.

use super::device::{self, Device, DevicePointer};
use super::error::{self, ERROR_INTERNAL, ERROR_WRONG_STATE, Failure, OK};
use crate::pool::arithmetic::Arithmetic;
use std::cell::{Cell, RefCell};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Arc, Once};

/// Makes exported functions from ordinary ones.
///
/// - `fn f(device, ..) = g;` looks the device up and calls `g(&Arc<Device>, ..)`; not allowed inside a
///   callback.
/// - `callback_safe fn f(device, ..) = g;` is allowed there.
/// - `free fn f(..) = g;` knows no device.
/// - `quiet fn f(..) = g;` knows none, is allowed in callbacks and leaves the error record alone.
/// - `value fn f(..) -> T = g, or d;` cannot fail and gives `d` after a panic.
macro_rules! export {
    ($($(#[$meta:meta])* fn $name:ident(device $(, $arg:ident: $type:ty)*) = $call:path;)+) => {
        $($crate::capi::guard::symbol! {
            $(#[$meta])* fn $name(device: $crate::capi::device::DevicePointer $(, $arg: $type)*) -> i32 {
                $crate::capi::guard::with_device(device, false, |device| $call(device $(, $arg)*))
            }
        })+
    };
    ($($(#[$meta:meta])* callback_safe fn $name:ident(device $(, $arg:ident: $type:ty)*) = $call:path;)+) => {
        $($crate::capi::guard::symbol! {
            $(#[$meta])* fn $name(device: $crate::capi::device::DevicePointer $(, $arg: $type)*) -> i32 {
                $crate::capi::guard::with_device(device, true, |device| $call(device $(, $arg)*))
            }
        })+
    };
    ($($(#[$meta:meta])* free fn $name:ident($($arg:ident: $type:ty),*) = $call:path;)+) => {
        $($crate::capi::guard::symbol! {
            $(#[$meta])* fn $name($($arg: $type),*) -> i32 {
                $crate::capi::guard::without_device(|| $call($($arg),*))
            }
        })+
    };
    ($($(#[$meta:meta])* quiet fn $name:ident($($arg:ident: $type:ty),*) = $call:path;)+) => {
        $($crate::capi::guard::symbol! {
            $(#[$meta])* fn $name($($arg: $type),*) -> i32 {
                $crate::capi::guard::value(|| $call($($arg),*).unwrap_or_else(|failure| failure.code),
                    $crate::capi::error::ERROR_INTERNAL)
            }
        })+
    };
    ($($(#[$meta:meta])* value fn $name:ident($($arg:ident: $type:ty),*) -> $result:ty = $call:path, or $default:expr;)+) => {
        $($crate::capi::guard::symbol! {
            $(#[$meta])* fn $name($($arg: $type),*) -> $result {
                $crate::capi::guard::value(|| $call($($arg),*), $default)
            }
        })+
    };
}
pub(super) use export;

/// One symbol.
macro_rules! symbol {
    ($(#[$meta:meta])* fn $name:ident($($arg:ident: $type:ty),*) -> $result:ty $body:block) => {
        $(#[$meta])*
        ///
        /// # Safety
        /// Pointers are as `caustica.h` asks.
        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $name($($arg: $type),*) -> $result $body
    };
}
pub(super) use symbol;

/// Body of a function that takes a device.
pub(super) fn with_device(
    pointer: DevicePointer,
    callback_safe: bool,
    body: impl FnOnce(&Arc<Device>) -> Result<i32, Failure>,
) -> i32 {
    let mut found = None;
    enter(pointer, &mut found, |found| {
        // Before it is refused, for the message.
        let device = device::find(pointer).map(|device| &*found.insert(device));
        refuse_in_callback(callback_safe)?;
        body(device?)
    })
}

/// Body of a function that a device does not outlive; what goes wrong is still said of it.
pub(super) fn about_device(pointer: DevicePointer, body: impl FnOnce() -> Result<i32, Failure>) -> i32 {
    // For the message of its refusal.
    let mut found = if in_callback() { device::find(pointer).ok() } else { None };
    enter(pointer, &mut found, |_| {
        refuse_in_callback(false)?;
        body()
    })
}

/// Body of a function that takes none.
pub(super) fn without_device(body: impl FnOnce() -> Result<i32, Failure>) -> i32 {
    about_device(DevicePointer::null(), body)
}

/// Body of a function that cannot fail.
pub(super) fn value<T>(body: impl FnOnce() -> T, default: T) -> T {
    let _here = Inside::enter();
    // A payload's own drop could panic again, so it is leaked.
    catch_unwind(AssertUnwindSafe(body)).unwrap_or_else(|payload| {
        std::mem::forget(payload);
        default
    })
}

fn refuse_in_callback(callback_safe: bool) -> Result<(), Failure> {
    if in_callback() && !callback_safe {
        return Err(Failure::new(ERROR_WRONG_STATE, "this function may not be called from inside a callback"));
    }
    Ok(())
}

fn enter(
    pointer: DevicePointer,
    found: &mut Option<Arc<Device>>,
    body: impl FnOnce(&mut Option<Arc<Device>>) -> Result<i32, Failure>,
) -> i32 {
    let _here = Inside::enter();
    let result = catch(|| body(found));
    let failure = match result {
        Ok(code) => return code,
        Err(failure) => failure,
    };
    let code = failure.code;
    let reported = catch(|| {
        error::remember(pointer, failure.clone());
        if let Some(device) = found.as_ref().filter(|_| !failure.told) {
            device.messages.error(&failure);
            // What fails within the host's callback is not what this call failed of.
            error::remember(pointer, failure);
        }
        Ok(OK)
    });
    if reported.is_ok() { code } else { ERROR_INTERNAL }
}

/// Runs `body`; a panic becomes a failure that carries its message and place.
pub(super) fn catch<T>(body: impl FnOnce() -> Result<T, Failure>) -> Result<T, Failure> {
    match catch_unwind(AssertUnwindSafe(body)) {
        Ok(result) => result,
        Err(payload) => {
            std::mem::forget(payload);
            let message = LAST_PANIC.try_with(|last| last.take()).ok().flatten();
            Err(Failure::internal(message.as_deref().unwrap_or("a panic without a message")))
        }
    }
}

thread_local! {
    /// How many of our functions this thread is inside of.
    static DEPTH: Cell<u32> = const { Cell::new(0) };
    /// Whether the host's code runs on this thread on our behalf.
    static IN_CALLBACK: Cell<bool> = const { Cell::new(false) };
    /// What the hook heard.
    static LAST_PANIC: RefCell<Option<String>> = const { RefCell::new(None) };
}

/// This thread runs code of ours until the value is dropped: panics are recorded and not printed, and
/// the floating-point state is the one Rust assumes.
pub(super) struct Inside {
    host_arithmetic: Arithmetic,
}

impl Inside {
    pub(super) fn enter() -> Inside {
        install_panic_hook();
        let _ = DEPTH.try_with(|depth| depth.set(depth.get() + 1));
        let inside = Inside { host_arithmetic: Arithmetic::of_thread() };
        Arithmetic::DEFAULT.set();
        inside
    }
}

impl Drop for Inside {
    fn drop(&mut self) {
        self.host_arithmetic.set();
        let _ = DEPTH.try_with(|depth| depth.set(depth.get() - 1));
    }
}

/// Calls the host back. What it does to the floating-point state ends with the call.
pub(super) fn call_host<T>(callback: impl FnOnce() -> T) -> T {
    let outer = IN_CALLBACK.try_with(|flag| flag.replace(true)).unwrap_or(true);
    let result = callback();
    let _ = IN_CALLBACK.try_with(|flag| flag.set(outer));
    Arithmetic::DEFAULT.set();
    result
}

/// Whether the host's code runs on this thread on our behalf.
pub(super) fn in_callback() -> bool {
    IN_CALLBACK.try_with(Cell::get).unwrap_or(false)
}

/// Rust prints the message of a panic before anybody can catch it. The hook keeps those of our own
/// threads and entry points off the host's stderr and stores the text for the error record; any other
/// panic goes where it went before. In the shared library nobody else has this hook, since its copy of
/// std is its own; a Rust program that links the crate keeps its own hook for its own panics.
fn install_panic_hook() {
    static INSTALLED: Once = Once::new();
    INSTALLED.call_once(|| {
        let previous = std::panic::take_hook();
        std::panic::set_hook(Box::new(move |info| {
            let entered = DEPTH.try_with(Cell::get).unwrap_or(0) > 0;
            let worker = std::thread::current().name().is_some_and(|name| name.starts_with("caustica-"));
            if entered {
                let text = info.payload().downcast_ref::<&str>().copied();
                let text =
                    text.or_else(|| info.payload().downcast_ref::<String>().map(String::as_str)).unwrap_or("panic");
                let place = info.location().map_or(String::new(), |l| format!(" ({}:{})", l.file(), l.line()));
                let _ = LAST_PANIC.try_with(|last| last.replace(Some(format!("{text}{place}"))));
            } else if !worker {
                previous(info);
            }
        }));
    });
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::capi::error::ERROR_INVALID_ARGUMENT;

    /// The last failure of this thread.
    fn last() -> Failure {
        error::last().unwrap()
    }

    #[test]
    fn a_panic_becomes_a_code_with_its_words_and_place() {
        let n = std::hint::black_box(3);
        assert_eq!(without_device(|| panic!("no more than {n}")), ERROR_INTERNAL);
        assert!(last().text.contains("no more than 3 (src/capi/guard.rs:"), "{}", last().text);
        assert_eq!(without_device(|| std::panic::panic_any(5)), ERROR_INTERNAL);
        assert_eq!(value(|| if n == 3 { panic!("again") } else { 1 }, 2), 2);
    }

    #[test]
    fn a_payload_that_panics_when_dropped_does_no_harm() {
        struct Bomb;
        impl Drop for Bomb {
            fn drop(&mut self) {
                panic!("dropped");
            }
        }
        assert_eq!(without_device(|| std::panic::panic_any(Bomb)), ERROR_INTERNAL);
        assert_eq!(value(|| std::panic::panic_any(Bomb), 7), 7);
    }

    /// Run alone by the next test, which looks at what it prints.
    #[test]
    fn panics_inside_and_in_workers() {
        assert_eq!(without_device(|| panic!("QUIET")), ERROR_INTERNAL);
        let worker = std::thread::Builder::new().name("caustica-0".to_owned()).spawn(|| panic!("QUIET"));
        assert!(worker.unwrap().join().is_err());
        assert!(std::thread::spawn(|| panic!("LOUD")).join().is_err());
    }

    #[test]
    fn our_panics_print_nothing_and_others_do() {
        let mut command = std::process::Command::new(std::env::current_exe().unwrap());
        command.args(["--exact", "capi::guard::tests::panics_inside_and_in_workers", "--nocapture"]);
        let output = command.output().unwrap();
        let printed = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success() && printed.contains("LOUD"), "{printed}");
        assert!(!printed.contains("QUIET"), "{printed}");
    }

    #[test]
    fn inside_a_callback_only_some_functions_work() {
        let plain = || without_device(|| Ok(OK));
        assert_eq!((plain(), call_host(plain), plain()), (OK, ERROR_WRONG_STATE, OK));
        let missing = |safe| with_device(DevicePointer::null(), safe, |_| Ok(OK));
        assert_eq!(call_host(|| missing(false)), ERROR_WRONG_STATE);
        assert_eq!(call_host(|| missing(true)), error::ERROR_INVALID_HANDLE);
    }

    #[test]
    fn a_failure_is_remembered_by_its_thread_alone() {
        assert_eq!(without_device(|| Err(Failure::argument("width", "is 0").at(4))), ERROR_INVALID_ARGUMENT);
        assert!(std::thread::spawn(|| error::last().is_none()).join().unwrap());
        assert_eq!(without_device(|| Ok(OK)), OK);
        assert_eq!((last().parameter.as_str(), last().index), ("width", 4));
    }
}
