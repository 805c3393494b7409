//! The `dovetail` program: see `dovetail --help`.

mod allocator;

#[global_allocator]
static MEMORY: allocator::Watched = allocator::Watched;

fn main() -> std::process::ExitCode {
    dovetail::cli::main()
}
