#pragma once

#include <cxxabi.h>
#include <pybind11/pybind11.h>
#include <unistd.h>

#include <utility>

// --- The interpreter's lock when the interpreter ends --------------------------------------------
//
// An interpreter that ends lets no other thread have its lock again: it calls pthread_exit in it,
// which unwinds the stack through the solver and through destructors that would need the lock. Such
// a thread sleeps instead until the process is gone.

namespace ipminmax::python {

namespace py = pybind11;

[[noreturn]] inline void sleep_until_the_end() {
  for (;;) pause();
}

inline bool interpreter_ends() {
#if PY_VERSION_HEX >= 0x030D0000
  return Py_IsFinalizing() != 0;
#else
  return _Py_IsFinalizing() != 0;
#endif
}

/// What call returns; it may need the lock.
template <class Call>
auto unless_the_interpreter_ends(Call call) {
  if (interpreter_ends()) sleep_until_the_end();
  try {
    return call();
  } catch (abi::__forced_unwind&) {
    sleep_until_the_end();
  }
}

/// Has the lock.
class Locked {
 public:
  Locked() : state_(unless_the_interpreter_ends([] { return PyGILState_Ensure(); })) {}
  ~Locked() { PyGILState_Release(state_); }
  Locked(const Locked&) = delete;
  Locked& operator=(const Locked&) = delete;

 private:
  PyGILState_STATE state_;
};

/// Gives the lock away.
class Unlocked {
 public:
  Unlocked() : state_(PyEval_SaveThread()) {}
  ~Unlocked() {
    unless_the_interpreter_ends([this] {
      PyEval_RestoreThread(state_);
      return 0;
    });
  }
  Unlocked(const Unlocked&) = delete;
  Unlocked& operator=(const Unlocked&) = delete;

 private:
  PyThreadState* state_;
};

/// function(arguments...), the lock held.
template <class... Arguments>
py::object call(const py::object& function, Arguments&&... arguments) {
  const py::tuple tuple = py::make_tuple(std::forward<Arguments>(arguments)...);
  PyObject* result = unless_the_interpreter_ends(
      [&] { return PyObject_Call(function.ptr(), tuple.ptr(), nullptr); });
  if (result == nullptr) throw py::error_already_set();
  return py::reinterpret_steal<py::object>(result);
}

}  // namespace ipminmax::python
