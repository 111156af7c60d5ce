//! A key file that other users can read.

use meshmark_host_tests::plugin::Host;
use std::{
    fs::{self, Permissions},
    os::unix::fs::PermissionsExt,
};

#[test]
fn a_key_that_others_can_read_is_warned_of_once_on_all_ways() {
    let host = Host::new();
    host.copy("kotka.gpkg", "map.gpkg");
    fs::write(host.path("list.csv"), "recipient\nACME\n").unwrap();
    let command = host.meshmark().display().to_string();
    let distribute = ["distribute", "--key", "key.json", "--recipients", "list.csv", "--output-dir", "out"];
    for (mode, times) in [(0o644, 1), (0o600, 0)] {
        fs::set_permissions(host.path("key.json"), Permissions::from_mode(mode)).unwrap();
        for said in [
            host.mark("GPKG", "read.gpkg", "map.gpkg", &["-oo", "RECORD=r.json"]).succeeds().stderr,
            host.create("written.gpkg", "map.gpkg", &[]).succeeds().stderr,
            host.run(&command, &[&distribute[..], &["map.gpkg"]].concat()).succeeds().stderr,
            host.verify("map.gpkg", &["--record", "r.json", "read.gpkg"]).0.succeeds().stderr,
        ] {
            let warned = said.matches("key.json has the rights 0644").count();
            assert_eq!((warned, said.matches("chmod 600").count()), (times, times), "{said}");
        }
        ["read.gpkg", "r.json", "written.gpkg", "ref.gpkg", "record.json"]
            .iter()
            .for_each(|name| fs::remove_file(host.path(name)).unwrap());
        fs::remove_dir_all(host.path("out")).unwrap();
    }
}
