//! The `dovetail` program: see `dovetail --help`.

fn main() -> std::process::ExitCode {
    dovetail::cli::main()
}
