"""Engines written in JavaScript, each from one file of an npm package, in V8 in a process of its
own."""
