//! The page that shows a session, and its server.
//!
//! [`Page::open`] binds the loopback address and serves the page from a thread of its own; [`Page::show`] runs the session in the
//! caller's thread until the page is closed. [`Frames`] and [`single_page`] do without a server: another
//! program, such as a notebook, has the page in a frame and passes its messages on. A [`LinkedDocument`] is an HTML text whose links open
//! pages.
//!
//! # Principles
//! 1. **For the user of this computer alone.** The server listens on the loopback address, every path begins with a secret of 128 random
//!    bits, and requests whose `Host` or `Origin` is not the server are refused: a page of another site can neither read nor steer.
//!    Connections without a request end after some seconds.
//! 2. **Only its own files.** They are compiled into the program. The server never opens a path of
//!    the file system.
//! 3. **Events are never dropped, samples are.** A sample is taken only after the previous one was
//!    sent.
//! 4. **No process is left.** The session ends some seconds after the page was closed.
//!
//! # What it will not do
//! Serve several pages at once: a new page takes the session over, and the old one waits until the new one is closed or its
//! user asks for the session.

mod assets;
mod door;
mod frames;
mod links;
mod listener;
mod server;
mod show;
mod single;

pub use frames::{FrameMessage, Frames};
pub use links::{AskedPage, LinkedDocument};
pub use listener::PageError;
pub use server::Page;
pub use single::single_page;
