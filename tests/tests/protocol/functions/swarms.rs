//! `swarm`: membership, sets of swarms, and `exec`.

use super::last;

#[test]
fn membership_reaches_neighbors() {
    last(
        3,
        4,
        "function init() {
           s = swarm.create(7)
           s.select(id != 2)
         }
         function step() {
           neighbors.broadcast(\"here\", 1)
           s.exec(function() { log(neighbors.kin().count(), \" \", neighbors.nonkin().count(), \" \", swarm.id()) })
           if(not s.in()) log(\"out \", swarm.id())
         }",
        &["1 1 7", "out nil", "1 1 7"],
    );
}

#[test]
fn leaving_reaches_neighbors() {
    last(
        2,
        8,
        "t = 0
         function init() { s = swarm.create(1)  s.join() }
         function step() {
           t = t + 1
           neighbors.broadcast(\"here\", 1)
           if(t == 5 and id == 2) s.leave()
           s.exec(function() { log(neighbors.kin().count()) })
         }",
        &["0", "1"],
    );
}

#[test]
fn sets_of_swarms() {
    last(
        4,
        1,
        "function init() {
           a = swarm.create(1)  a.select(id <= 2)
           b = swarm.create(2)  b.select(id == 2 or id == 3)
           u = swarm.union(3, a, b)
           i = swarm.intersection(4, a, b)
           d = swarm.difference(5, a, b)
           o = a.others(6)
         }
         function step() { log(u.in(), i.in(), d.in(), o.in(), \" \", u.id, i.id, d.id, o.id) }",
        &["1010 3456", "1100 3456", "1001 3456", "0001 3456"],
    );
}

#[test]
fn exec_returns_the_value_and_nests() {
    last(
        1,
        1,
        "function step() {
           var a = swarm.create(1)
           var b = swarm.create(2)
           a.join()  b.join()
           var x = a.exec(function() {
             return b.exec(function() { return swarm.id() * 100 + swarm.id(1) * 10 })
           })
           b.unselect(0)
           var still = b.in()
           b.unselect(1)
           log(x, \" \", isnil(b.exec(function() { return 1 })), still, b.in(), isnil(swarm.id()))
         }",
        &["210 1101"],
    );
}

#[test]
fn methods_are_values_bound_to_their_swarm() {
    last(
        1,
        1,
        "function step() {
           var a = swarm.create(1)
           var b = swarm.create(2)
           var t = {}
           t.join = a.join
           t.join()
           var is_in = b.in
           foreach({.1 = 1}, b.select)
           log(a.in(), is_in(), swarm.create(1).in())
         }",
        &["111"],
    );
}
