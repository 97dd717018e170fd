//! A team of MPI processes: `mpirun -n 4 luxmap render …`.
//!
//! MPI's handles belong to the thread that made them, so one thread makes all calls, and the others ask it.

use std::io;
use std::sync::Mutex;
use std::sync::mpsc::{self, Sender};
use std::thread::{self, JoinHandle};

use mpi::Threading;
use mpi::topology::SimpleCommunicator;
use mpi::traits::{Communicator, CommunicatorCollectives, Destination, Root, Source};

use super::team::{Instruction, Team};
use crate::error::Error;

/// Bytes sent at once: MPI counts in `i32`.
const PART: usize = 1 << 30;

/// What the thread that may call MPI is asked to do.
type Call = Box<dyn FnOnce(&SimpleCommunicator) + Send>;

/// The processes that mpirun started. Dropped before [`World::leave`], it ends them all: the others would wait for one
/// that is lost.
pub struct World {
    calls: Mutex<Option<Sender<Call>>>,
    thread: Option<JoinHandle<()>>,
    rank: u32,
    size: u32,
}

impl World {
    /// Joins the processes that a launcher started together; `None` where there is only this one.
    pub fn join() -> Result<Option<Self>, Error> {
        if super::team::launched() < 2 {
            return Ok(None);
        }
        let (calls, called) = mpsc::channel::<Call>();
        let (ready, started) = mpsc::channel();
        let thread = thread::spawn(move || {
            let Some((universe, _)) = mpi::initialize_with_threading(Threading::Funneled) else { return };
            let world = universe.world();
            if ready.send((world.rank(), world.size())).is_ok() {
                called.iter().for_each(|call| call(&world));
            }
        });
        let (rank, size) = started.recv().map_err(|_| Error::Usage("MPI: can't be initialised".into()))?;
        let calls = Mutex::new(Some(calls));
        Ok(Some(Self { calls, thread: Some(thread), rank: rank as u32, size: size as u32 }))
    }

    /// The first process in which something `failed`; all must ask together.
    pub fn first_failure(&self, failed: bool) -> Option<u32> {
        let size = self.size as usize;
        let all = self.call(move |world| {
            let mut all = vec![0_u8; size];
            world.all_gather_into(&u8::from(failed), &mut all[..]);
            all
        });
        all.iter().position(|&failed| failed > 0).map(|rank| rank as u32)
    }

    /// Ends this process's part; all must do so.
    pub fn leave(mut self) {
        self.close();
    }

    fn close(&mut self) {
        if let Ok(mut calls) = self.calls.lock() {
            *calls = None;
        }
        if let Some(thread) = self.thread.take() {
            let _ = thread.join(); // it returns nothing
        }
    }

    /// Has the thread of MPI do something.
    fn call<R: Send + 'static>(&self, what: impl FnOnce(&SimpleCommunicator) -> R + Send + 'static) -> R {
        let (answer, answered) = mpsc::channel();
        let call: Call = Box::new(move |world| {
            let _ = answer.send(what(world)); // the caller waits for it
        });
        let calls = self.calls.lock().expect("no call panics with the lock held");
        calls
            .as_ref()
            .expect("there are no calls after the end")
            .send(call)
            .expect("the thread lives as long as its calls");
        drop(calls);
        answered.recv().expect("a failing MPI call ends the process")
    }
}

impl Drop for World {
    fn drop(&mut self) {
        if self.thread.is_some() {
            self.call(|world| world.abort(2));
        }
    }
}

impl Team for World {
    fn size(&self) -> u32 {
        self.size
    }

    fn rank(&self) -> u32 {
        self.rank
    }

    fn hand_in(&self, found: &[u8], hear: &mut dyn FnMut(&[u8]) -> io::Result<()>) -> io::Result<()> {
        if self.rank > 0 {
            let found = found.to_vec();
            self.call(move |world| {
                let leader = world.process_at_rank(0);
                leader.send(&(found.len() as u64));
                found.chunks(PART).for_each(|part| leader.send(part));
            });
            return Ok(());
        }
        for rank in 1..self.size {
            let found = self.call(move |world| {
                let process = world.process_at_rank(rank as i32);
                let (length, _) = process.receive::<u64>();
                let mut found = vec![0_u8; length as usize];
                found.chunks_mut(PART).for_each(|part| {
                    process.receive_into(part);
                });
                found
            });
            hear(&found)?;
        }
        Ok(())
    }

    fn broadcast(&self, instruction: Instruction) -> Instruction {
        let leads = self.rank == 0;
        let Instruction { over, done, next_check, rest } = instruction;
        let said: Vec<u32> =
            [u32::from(over), done, next_check].into_iter().chain(rest.into_iter().map(u32::from)).collect();
        let heard = self.call(move |world| {
            let mut heard = if leads { said } else { vec![0; said.len()] };
            world.process_at_rank(0).broadcast_into(&mut heard[..]);
            heard
        });
        let rest = heard[3..].iter().map(|&rests| rests > 0).collect();
        Instruction { over: heard[0] > 0, done: heard[1], next_check: heard[2], rest }
    }
}
