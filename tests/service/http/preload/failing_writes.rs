//! Loaded before the C library (LD_PRELOAD), this has writes to files fail as on a full disk, from the one on that the
//! test chooses. The two share a file: how many writes may still succeed (all of them if negative), how many there have
//! been, and whether those that would fail never return instead, as on a disk that has gone.

use std::ffi::{CString, c_char, c_int, c_void};
use std::fs::File;
use std::mem::ManuallyDrop;
use std::os::fd::FromRawFd;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicI64, Ordering};

unsafe extern "C" {
    fn dlsym(handle: *mut c_void, symbol: *const c_char) -> *mut c_void;
    fn __errno_location() -> *mut c_int;
    fn open(path: *const c_char, flags: c_int, ...) -> c_int;
    fn mmap(at: *mut c_void, size: usize, access: c_int, flags: c_int, file: c_int, offset: i64) -> *mut c_void;
}

const RTLD_NEXT: *mut c_void = -1_isize as *mut c_void;
const O_RDWR: c_int = 2;
const PROT_READ_WRITE: c_int = 3;
const MAP_SHARED: c_int = 1;
const EIO: c_int = 5;
const ENOSPC: c_int = 28;

struct Control {
    left: AtomicI64,
    count: AtomicI64,
    stuck: AtomicI64,
}

fn control() -> Option<&'static Control> {
    static CONTROL: OnceLock<Option<&'static Control>> = OnceLock::new();
    *CONTROL.get_or_init(|| {
        let path = CString::new(std::env::var("FAILING_WRITES").ok()?).ok()?;
        // SAFETY: the file is as long as the structure, and stays mapped until the process ends.
        unsafe {
            let file = open(path.as_ptr(), O_RDWR);
            let size = size_of::<Control>();
            let at = mmap(std::ptr::null_mut(), size, PROT_READ_WRITE, MAP_SHARED, file, 0);
            (file >= 0 && at as isize != -1).then(|| &*at.cast::<Control>())
        }
    })
}

/// Whether this write is to fail.
fn fails() -> bool {
    let Some(control) = control() else { return false };
    control.count.fetch_add(1, Ordering::SeqCst);
    let one_less = |left: i64| (left > 0).then(|| left - 1);
    // What it was before; it stays at 0 and below.
    match control.left.fetch_update(Ordering::SeqCst, Ordering::SeqCst, one_less) {
        Ok(_) => false,
        Err(0) if control.stuck.load(Ordering::SeqCst) != 0 => loop {
            std::thread::park();
        },
        Err(left) => left == 0,
    }
}

/// Whether it is a file on a disk, and no socket, pipe or event counter.
fn is_file(file: c_int) -> bool {
    // SAFETY: it is only looked at, and not closed.
    let file = ManuallyDrop::new(unsafe { File::from_raw_fd(file) });
    file.metadata().is_ok_and(|about| about.is_file())
}

fn fail(error: c_int) -> isize {
    // SAFETY: the place belongs to this thread.
    unsafe { *__errno_location() = error };
    -1
}

/// Declares functions that stand before those of the C library: they fail with the given error where it is their turn.
macro_rules! before {
    ($($name:ident($($argument:ident: $kind:ty),*) -> $result:ty, $if:expr, $error:expr;)*) => {$(
        /// # Safety
        /// As the function of the C library.
        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $name($($argument: $kind),*) -> $result {
            static NEXT: OnceLock<usize> = OnceLock::new();
            let keep_error = unsafe { *__errno_location() };
            if $if && fails() {
                return fail($error) as $result;
            }
            unsafe { *__errno_location() = keep_error };
            let next = *NEXT.get_or_init(|| {
                let name = concat!(stringify!($name), "\0");
                unsafe { dlsym(RTLD_NEXT, name.as_ptr().cast()) as usize }
            });
            let next: unsafe extern "C" fn($($kind),*) -> $result = unsafe { std::mem::transmute(next) };
            unsafe { next($($argument),*) }
        }
    )*};
}

before! {
    write(file: c_int, from: *const c_void, size: usize) -> isize, is_file(file), ENOSPC;
    pwrite(file: c_int, from: *const c_void, size: usize, at: i64) -> isize, is_file(file), ENOSPC;
    pwrite64(file: c_int, from: *const c_void, size: usize, at: i64) -> isize, is_file(file), ENOSPC;
    ftruncate(file: c_int, size: i64) -> c_int, is_file(file), ENOSPC;
    ftruncate64(file: c_int, size: i64) -> c_int, is_file(file), ENOSPC;
    fsync(file: c_int) -> c_int, true, EIO;
    fdatasync(file: c_int) -> c_int, true, EIO;
    rename(from: *const c_char, to: *const c_char) -> c_int, true, ENOSPC;
    mkdir(path: *const c_char, mode: u32) -> c_int, true, ENOSPC;
}
