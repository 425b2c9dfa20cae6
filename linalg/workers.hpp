#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <exception>
#include <memory>
#include <vector>

#include "linalg/uncopied.hpp"

namespace ipminmax {

/// Threads that wait between the pieces of work of one caller: made when they are first needed,
/// with the signals blocked that a program handles in its own threads, joined by the destructor.
/// In a child of fork, where they do not exist, they are made anew; one that is made in the middle
/// of their work must not return into it.
class Workers : Uncopied {
 public:
  Workers();
  ~Workers();

  /// piece(0), ..., piece(count - 1), in the caller's thread and others, with the caller's
  /// floating-point environment; all of them in the caller's where there are no threads to be had,
  /// or the caller holds the lock of MUMPS (library_lock.hpp), for which they might wait. piece
  /// must not throw. Allocates nothing once the threads are there.
  template <class Piece>
  void run(int count, const Piece& piece) {
    run(count, &call<Piece>, &piece);
  }

 private:
  using Call = void (*)(const void* piece, int index);
  template <class Piece>
  static void call(const void* piece, int index) {
    (*static_cast<const Piece*>(piece))(index);
  }
  void run(int count, Call run_piece, const void* piece);
  [[nodiscard]] int have_threads(int wanted);

  struct Team;
  std::unique_ptr<Team> team_;
};

/// Calls task(k, thread) for k = 0, ..., count - 1, which so many threads take in turn. After one
/// has thrown none is begun; what the first of them threw is thrown when all have ended.
template <class Task>
void share_tasks(Workers& workers, std::size_t threads, std::size_t count, const Task& task) {
  std::vector<std::exception_ptr> failures(count);
  std::atomic<std::size_t> next = 0;
  workers.run(static_cast<int>(std::min(threads, count)), [&](int thread) {
    for (std::size_t k = next++; k < count; k = next++) {
      try {
        task(k, static_cast<std::size_t>(thread));
      } catch (...) {
        failures[k] = std::current_exception();
        next = count;
      }
    }
  });
  for (const std::exception_ptr& failure : failures) {
    if (failure) std::rethrow_exception(failure);
  }
}

}  // namespace ipminmax
