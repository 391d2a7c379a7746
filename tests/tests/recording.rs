//! The recorder as a process: recordings of live nodes, simulations and playbacks, and bad input.

mod bad_input;
mod coverage;
mod end_to_end;
mod files;
mod hostile;
mod interrupt;
mod losses;
mod outputs;
mod physics;
mod play {
    mod border;
    mod files;
    mod keys;
    mod lockstep;
    mod middle;
    mod seek;
}
mod raw;
mod repair;
mod states;
mod threads;
