//! Processes under adversity: flooding and killed clients, requests to stop, streams that refuse
//! output, and shared memory that is full or cut.

mod cut_memory;
mod fairness;
mod full_memory;
mod grabs;
mod owner;
mod stop;
mod streams;
