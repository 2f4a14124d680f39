"""A master of the tests' own: the C functions of an unpacked FMU through ctypes, nothing hidden.

Statuses are returned and never raised, so that tests see what a C master would see. `Instance` has
the same methods for FMI 2 and FMI 3.
"""

import ctypes
import xml.etree.ElementTree as xml
import zipfile
from ctypes import POINTER, byref, c_bool, c_char_p, c_double, c_int, c_int32, c_size_t, c_uint32
from ctypes import c_uint64, c_uint8, c_void_p
from pathlib import Path

import numpy as np

OK, WARNING, DISCARD, ERROR = 0, 1, 2, 3

LOG3 = ctypes.CFUNCTYPE(None, c_void_p, c_int, c_char_p, c_char_p)
# the real one is variadic; toile passes no further arguments
LOG2 = ctypes.CFUNCTYPE(None, c_void_p, c_char_p, c_int, c_char_p, c_char_p)

TYPES = {
    "Float64": (c_double, np.float64),
    "Real": (c_double, np.float64),
    "Int32": (c_int32, np.int32),
    "Integer": (c_int32, np.int32),
    "UInt32": (c_uint32, np.uint32),
    "UInt64": (c_uint64, np.uint64),
}


class Callbacks2(ctypes.Structure):
    _fields_ = [
        ("logger", c_void_p),
        ("allocate", c_void_p),
        ("free", c_void_p),
        ("finished", c_void_p),
        ("environment", c_void_p),
    ]


class Variable:
    def __init__(self, reference, kind, attributes, shape):
        self.reference, self.kind, self.attributes, self.shape = reference, kind, attributes, shape


class Fmu:
    """An archive, unpacked into a folder."""

    def __init__(self, archive, folder):
        self.folder = Path(folder)
        with zipfile.ZipFile(archive) as z:
            z.extractall(self.folder)
        self.root = xml.parse(self.folder / "modelDescription.xml").getroot()
        self.version = 3 if self.root.get("fmiVersion") == "3.0" else 2
        self.token = self.root.get("instantiationToken") or self.root.get("guid")
        self.identifier = self.root.find("CoSimulation").get("modelIdentifier")
        platform = "x86_64-linux" if self.version == 3 else "linux64"
        self.binary = self.folder / "binaries" / platform / f"{self.identifier}.so"
        self.resources = self.folder / "resources"
        self.variables = {}
        for element in self.root.find("ModelVariables"):
            inner = element if self.version == 3 else element[0]
            attributes = {**element.attrib, **inner.attrib}
            shape = [self._size(d) for d in element.findall("Dimension")]
            reference = int(element.get("valueReference"))
            self.variables[element.get("name")] = Variable(reference, inner.tag, attributes, shape)
        self.library = ctypes.CDLL(str(self.binary))

    def _size(self, dimension):
        if dimension.get("start"):
            return int(dimension.get("start"))
        reference = dimension.get("valueReference")
        found = [v for v in self.root.find("ModelVariables") if v.get("valueReference") == reference]
        assert [v.tag for v in found] == ["UInt64"]
        assert found[0].get("causality") == "structuralParameter"
        return int(found[0].get("start"))

    def names(self, causality):
        return [n for n, v in self.variables.items() if v.attributes.get("causality") == causality]

    def instance(self, **how):
        made = Instance(self, **how)
        assert made.pointer, made.logs
        return made


class Instance:
    def __init__(
        self, fmu, name=b"cloth", token=None, resources=None, logging=False, callback=True
    ):
        self.fmu, self.library, self.logs = fmu, fmu.library, []
        self.three = fmu.version == 3
        token = fmu.token.encode() if token is None else token
        if self.three:
            resources = str(fmu.resources).encode() if resources is None else resources
            self._log = LOG3(lambda e, s, c, m: self.logs.append((s, c.decode(), m.decode())))
            make = self.library.fmi3InstantiateCoSimulation
            make.restype = c_void_p
            self.pointer = make(
                c_char_p(name), c_char_p(token), c_char_p(resources), c_bool(False),
                c_bool(logging), c_bool(False), c_bool(False), None, c_size_t(0), None,
                self._log if callback else None, None,
            )
        else:
            resources = fmu.resources.as_uri().encode() if resources is None else resources
            self._log = LOG2(lambda e, n, s, c, m: self.logs.append((s, c.decode(), m.decode())))
            self._callbacks = Callbacks2()
            if callback:
                self._callbacks.logger = ctypes.cast(self._log, c_void_p)
            make = self.library.fmi2Instantiate
            make.restype = c_void_p
            self.pointer = make(
                c_char_p(name), c_int(1), c_char_p(token), c_char_p(resources),
                byref(self._callbacks), c_int(0), c_int(logging),
            )

    # every function by its name without the version: `call("Reset")`
    def call(self, name, *arguments):
        function = getattr(self.library, f"fmi{self.fmu.version}{name}")
        return function(c_void_p(self.pointer), *arguments)

    def free(self):
        function = getattr(self.library, f"fmi{self.fmu.version}FreeInstance")
        function.restype = None
        function(c_void_p(self.pointer))
        self.pointer = None

    def initialize(self, start=0.0, stop=None):
        """From Instantiated to stepping; the status of the last call."""
        assert self.enter(start, stop) == OK, self.logs
        return self.call("ExitInitializationMode")

    def enter(self, start=0.0, stop=None, tolerance=None):
        times = [
            c_bool(tolerance is not None) if self.three else c_int(tolerance is not None),
            c_double(tolerance or 0.0),
            c_double(start),
            c_bool(stop is not None) if self.three else c_int(stop is not None),
            c_double(0.0 if stop is None else stop),
        ]
        if self.three:
            return self.call("EnterInitializationMode", *times)
        status = self.call("SetupExperiment", *times)
        return status or self.call("EnterInitializationMode")

    def step(self, time, size):
        if not self.three:
            return self.call("DoStep", c_double(time), c_double(size), c_int(1))
        flags = [c_uint8(9), c_uint8(9), c_uint8(9)]
        self.last = c_double(-1.0)
        status = self.call(
            "DoStep", c_double(time), c_double(size), c_bool(True),
            byref(flags[0]), byref(flags[1]), byref(flags[2]), byref(self.last),
        )
        if status == OK:
            assert [f.value for f in flags] == [0, 0, 0]
        return status

    def run(self, steps, size=0.01, first=0, at=0.0):
        for i in range(first, first + steps):
            assert self.step(at + i * size, size) == OK, self.logs

    def _function(self, what, kind):
        return getattr(self.library, f"fmi{self.fmu.version}{what}{kind}")

    def get_raw(self, kind, references, count=None, room=None):
        """Status and values of `references`; `count` is the announced number of values."""
        ctype = TYPES[kind][0] if kind in TYPES else (c_uint8 if self.three else c_int)
        count = len(references) if count is None else count
        values = (ctype * max(count if room is None else room, 1))()
        refs = (c_uint32 * max(len(references), 1))(*references)
        last = [c_size_t(count)] if self.three else []
        status = self._function("Get", kind)(
            c_void_p(self.pointer), refs, c_size_t(len(references)), values, *last
        )
        return status, values

    def set_raw(self, kind, references, values):
        ctype = TYPES[kind][0] if kind in TYPES else (c_uint8 if self.three else c_int)
        refs = (c_uint32 * max(len(references), 1))(*references)
        data = (ctype * max(len(values), 1))(*values)
        last = [c_size_t(len(values))] if self.three else []
        return self._function("Set", kind)(
            c_void_p(self.pointer), refs, c_size_t(len(references)), data, *last
        )

    def get(self, *names):
        out = []
        for name in names:
            v = self.fmu.variables[name]
            count = int(np.prod(v.shape)) if v.shape else 1
            status, values = self.get_raw(v.kind, [v.reference], count)
            assert status in (OK, WARNING), (name, self.logs)
            out.append(np.array(values[:count]).reshape(v.shape) if v.shape else values[0])
        return out[0] if len(out) == 1 else out

    def set(self, **values):
        return self.put(values)

    def put(self, values):
        """Sets by name; the worst status."""
        worst = OK
        for name, value in values.items():
            v = self.fmu.variables[name]
            values = np.ravel(value).tolist()
            worst = max(worst, self.set_raw(v.kind, [v.reference], values))
        return worst

    def snapshot(self):
        """The Binary output, copied."""
        sizes, values = (c_size_t * 1)(), (c_void_p * 1)()
        refs = (c_uint32 * 1)(self.fmu.variables["snapshot"].reference)
        status = self.call("GetBinary", refs, c_size_t(1), sizes, values, c_size_t(1))
        assert status == OK, self.logs
        return ctypes.string_at(values[0], sizes[0])

    def outputs(self):
        """All outputs as bytes: equal only if every bit is."""
        parts = []
        for name in self.fmu.names("output"):
            v = self.fmu.variables[name]
            if v.kind == "Binary":
                parts.append(self.snapshot())
                continue
            count = int(np.prod(v.shape)) if v.shape else 1
            status, values = self.get_raw(v.kind, [v.reference], count)
            assert status == OK, (name, self.logs)
            parts.append(bytes(values))
        return b"".join(parts)

    # saved states
    def _state(self, name):
        return self._function(name, "FMUState" if self.three else "FMUstate")

    def get_state(self, state=None):
        state = c_void_p() if state is None else state
        return self._state("Get")(c_void_p(self.pointer), byref(state)), state

    def set_state(self, state):
        return self._state("Set")(c_void_p(self.pointer), state)

    def free_state(self, state):
        return self._state("Free")(c_void_p(self.pointer), byref(state))

    def serialize(self, state):
        size = c_size_t()
        name = "SerializedFMUStateSize" if self.three else "SerializedFMUstateSize"
        assert self.call(name, state, byref(size)) == OK, self.logs
        data = (c_uint8 * size.value)()
        name = "SerializeFMUState" if self.three else "SerializeFMUstate"
        assert self.call(name, state, data, size) == OK, self.logs
        return bytes(data)

    def deserialize(self, data, size=None):
        state = c_void_p()
        room = (c_uint8 * max(len(data), 1)).from_buffer_copy(data or b"\0")
        name = "DeserializeFMUState" if self.three else "DeSerializeFMUstate"
        status = self.call(name, room, c_size_t(len(data) if size is None else size), byref(state))
        return status, state
