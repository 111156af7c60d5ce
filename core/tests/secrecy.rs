//! The memory of a process after it used a key. The only test of this process, which searches its
//! own memory; the secret is never written down here but computed digit by digit.

use meshmark_core::{
    carrier::Carrier,
    key::{SecretKey, read_text},
    options::Subject,
};
use std::{
    fs::{self, File},
    io::{Read, Seek, SeekFrom, Write},
    path::Path,
};
use zeroize::Zeroize;

const BYTES: usize = 32;

/// Returns a byte of the secret.
fn byte(at: usize) -> u8 {
    (at * 73 + 41) as u8 ^ 0x5a
}

/// Returns a digit of the secret.
fn digit(at: usize) -> u8 {
    let nibble = if at.is_multiple_of(2) { byte(at / 2) >> 4 } else { byte(at / 2) & 15 };
    b"0123456789abcdef"[usize::from(nibble)]
}

/// The part of memory that is searched at once, and the overlap with the next one.
const PART: usize = 1 << 16;
const OVERLAP: usize = 2 * BYTES - 1;

/// Counts the places in this process's memory that hold the secret, as bytes and as digits.
fn copies() -> [usize; 2] {
    let mut memory = File::open("/proc/self/mem").unwrap();
    let maps = fs::read_to_string("/proc/self/maps").unwrap();
    let mut part = vec![0; PART];
    let own = part.as_ptr() as u64..part.as_ptr() as u64 + PART as u64;
    let mut found = [0; 2];
    for line in maps.lines().filter(|line| line.contains(" rw")) {
        let (start, end) = line.split_once(' ').unwrap().0.split_once('-').unwrap();
        let [start, end] = [start, end].map(|at| u64::from_str_radix(at, 16).unwrap());
        // Reading would copy into itself what is beside the buffer.
        let around = [start..end.min(own.start), start.max(own.end)..end];
        for (at, end) in around.into_iter().flat_map(|range| {
            let end = range.end;
            range.step_by(PART - OVERLAP).map(move |at| (at, end))
        }) {
            let wanted = PART.min((end - at) as usize);
            memory.seek(SeekFrom::Start(at)).unwrap();
            memory.read_exact(&mut part[..wanted]).unwrap();
            let count = |length_of: usize, of: fn(usize) -> u8| {
                let is_here = |from: usize| (0..length_of).all(|i| part.get(from + i) == Some(&of(i)));
                (0..wanted.min(PART - OVERLAP)).filter(|from| is_here(*from)).count()
            };
            let in_part = [count(BYTES, byte), count(2 * BYTES, digit)];
            part.as_mut_slice().zeroize();
            found = [found[0] + in_part[0], found[1] + in_part[1]];
        }
    }
    found
}

/// Something that has a key and moves, as a request does.
struct Request {
    _more: [u64; 9],
    key: SecretKey,
}

#[inline(never)]
fn moved(request: Request) -> Request {
    std::hint::black_box(request)
}

#[inline(never)]
fn used(path: &Path) {
    let key = SecretKey::from_json(&read_text(File::open(path).unwrap()).unwrap()).unwrap();
    let request = moved(moved(Request { _more: [7; 9], key }));
    let subject = Subject::Recipient("ACME".into());
    let _ = (Carrier::new(&request.key), subject.message(&request.key), request.key.commitment());
    let boxed = Box::new((request.key.clone(), moved(request)));
    assert_eq!(copies(), [1, 0], "while the key is used");
    drop(boxed);
}

#[inline(never)]
fn made(path: &Path) {
    let fill = |secret: &mut [u8]| -> Result<(), ()> {
        secret.iter_mut().enumerate().for_each(|(at, to)| *to = byte(at));
        Ok(())
    };
    let key = SecretKey::filled(fill).unwrap();
    File::create(path).unwrap().write_all(key.to_json().as_bytes()).unwrap();
}

#[test]
fn a_key_has_one_place_in_memory_and_none_afterwards() {
    let path = std::env::temp_dir().join(format!("meshmark-secrecy-{}.json", std::process::id()));
    made(&path);
    assert_eq!(copies(), [0; 2], "after a key was made");
    used(&path);
    assert_eq!(copies(), [0; 2], "after a key was used");
    fs::remove_file(path).unwrap();
}
