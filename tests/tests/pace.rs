//! When a node makes its next step: after a long wait, beside a load, in lockstep with other processes, and
//! with the scheduling of the system; and `sim-node bench`, which measures that.

mod bench;
mod distant_step;
mod load;
mod lockstep;
mod prepared;
mod real_time;
