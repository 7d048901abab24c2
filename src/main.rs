//! The command `gaitwright`.

mod cli;

use std::process::ExitCode;

use mimalloc::MiMalloc;

/// A motion that is judged takes a hundred megabytes for some seconds, on whichever thread; glibc's allocator keeps them for
/// good, once for every thread that ever had them.
#[global_allocator]
static ALLOCATOR: MiMalloc = MiMalloc;

fn main() -> ExitCode {
    cli::main()
}
