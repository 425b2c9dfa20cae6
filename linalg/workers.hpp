#pragma once

#include <memory>

#include "linalg/uncopied.hpp"

namespace ipminmax {

/// Threads that wait between the pieces of work of one caller: made when they are first needed,
/// with the signals blocked that a program handles in its own threads, joined by the destructor.
/// In a child of fork, where they do not exist, they are made anew.
class Workers : Uncopied {
 public:
  Workers();
  ~Workers();

  /// piece(0), ..., piece(count - 1), in the caller's thread and others, with the caller's
  /// floating-point environment; all of them in the caller's where there are no threads to be had.
  /// piece must not throw. Allocates nothing once the threads are there.
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

}  // namespace ipminmax
