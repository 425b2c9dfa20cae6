#pragma once

#include <mpi.h>

#include <chrono>
#include <cstdint>
#include <functional>
#include <string>

#include "linalg/array.hpp"
#include "linalg/mpi/interface.hpp"

namespace ipminmax::mpi {

/// Messages of a session's communicator.
enum Tag : int { kCommand = 1, kMessage };

/// This process among the ranks of MPI_COMM_WORLD. One per process.
///
/// Joining is done with single messages and time limits, so that a rank that runs something else is
/// named instead of waited for; the communicator is made when every rank has said who it is.
class Session {
 public:
  static Session& of_process();

  /// Null, or what is wrong; then and for good.
  [[nodiscard]] const char* join(Role role, const std::string& version);
  /// The worker's side: waits for the program. Empty, or what is wrong.
  [[nodiscard]] std::string join_as_worker(const std::string& version);

  [[nodiscard]] MPI_Comm communicator() const { return communicator_; }
  [[nodiscard]] int rank() const { return rank_; }
  [[nodiscard]] int size() const { return size_; }

  /// Runs a task that calls MPI, and stops waiting for it when the launcher ends the program. Null,
  /// or why it has no result; then MPI must not be used again.
  [[nodiscard]] const char* call(const std::function<void()>& task);
  /// Waits a little for something from other ranks; waited: number of calls in a row so far.
  static void pause(int& waited);
  /// Why the other ranks cannot be worked with, null: they can.
  [[nodiscard]] const char* trouble();
  /// Whether that rank's process has ended, as far as can be seen from this machine.
  [[nodiscard]] bool gone(int rank) const;
  /// Nobody waits for that rank any more; MPI, which would, is not finalized.
  void forget(int rank);
  [[nodiscard]] bool is_abandoned() const { return abandoned_; }
  [[nodiscard]] bool is_forgotten(int rank) const { return forgotten_[rank]; }

  /// Called once before MPI is finalized, whoever does that.
  void at_leave(std::function<void()> task) { at_leave_ = std::move(task); }
  void leave();

 private:
  struct Hello;
  struct Welcome;
  Session() = default;
  void initialize();
  [[nodiscard]] std::string gather(Role role, const std::string& version);
  [[nodiscard]] std::string say_hello(Role role, const std::string& version);
  [[nodiscard]] std::string await_welcome(double seconds);
  const char* fail(std::string text);
  [[nodiscard]] std::string why_stopped() const;
  void run_watched(const std::function<void()>& task) const;
  void release();
  static int before_finalize(MPI_Comm, int, void*, void*);

  MPI_Comm communicator_ = MPI_COMM_NULL;
  Role role_{};
  bool joined_ = false, left_ = false, abandoned_ = false;
  int rank_ = 0, size_ = 1, level_ = 0;
  struct Peer {
    std::int32_t pid = 0;  ///< 0: not known, or on another machine
    std::string host;
  };
  Array<Peer> peers_;  ///< by rank
  Array<bool> forgotten_;
  std::string error_;
  std::function<void()> at_leave_;
};

[[nodiscard]] double seconds_since(std::chrono::steady_clock::time_point begin);

/// Set by SIGTERM, see Plugin::stop_requested.
[[nodiscard]] bool stop_requested();

}  // namespace ipminmax::mpi
