#pragma once

#include <chrono>
#include <cstdint>
#include <exception>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/multistart.hpp"
#include "core/result.hpp"
#include "linalg/inertia.hpp"
#include "linalg/mpi/interface.hpp"

namespace ipminmax {

/// What an exception says, for ranks that cannot be given it.
[[nodiscard]] std::string what_of(const std::exception_ptr& exception);

/// Messages between the ranks of one multistart, which all have made this object. One thread only.
class Ranks {
 public:
  enum class Kind : std::uint32_t {
    Ready,        ///< to rank 0: a thread wants a start
    Start,        ///< from rank 0: make this one
    Result,       ///< to rank 0: of that start; the thread is ready again
    Failure,      ///< exception of the model in that start
    Interrupted,  ///< to rank 0: by a limit or the observer
    Stop,         ///< from rank 0: end what runs
    Ended,        ///< to rank 0: all threads have
    Final,        ///< from rank 0: the answer
    Beat          ///< alive
  };
  struct Message {
    int rank = 0;
    Kind kind{};
    Index start = 0;
    std::vector<char> bytes;
    [[nodiscard]] std::string text() const { return {bytes.begin(), bytes.end()}; }
  };

  /// Seconds of silence after which a rank counts as dead.
  static constexpr double kDeadAfter = 60.0;

  struct Place {
    int rank, size;
  };
  /// This process among the ranks. Throws as the constructor.
  [[nodiscard]] static Place join();

  /// Throws SolverUnavailable where MPI cannot be used, or not all ranks came.
  Ranks();
  Ranks(const Ranks&) = delete;
  Ranks& operator=(const Ranks&) = delete;

  [[nodiscard]] int rank() const { return plugin_.rank(); }
  [[nodiscard]] int size() const { return plugin_.size(); }
  void send(int rank, Kind kind, Index start = 0, std::span<const char> bytes = {});
  /// Of rank 0: to all others.
  void send_to_others(Kind kind, Index start = 0, std::span<const char> bytes = {});
  /// The next message that is not a beat.
  [[nodiscard]] std::optional<Message> receive();
  /// Once a second: tells others that this rank lives. Rank 0 tells all, the others rank 0.
  void beat();
  /// The launcher wants an end.
  [[nodiscard]] bool stop_requested() const { return plugin_.stop_requested(); }
  /// That process has ended, as far as can be seen from this machine, or was silent for so many
  /// seconds.
  [[nodiscard]] bool is_lost(int rank, double seconds = kDeadAfter) const;
  /// That rank is dead: MPI is left without waiting for it.
  void forget(int rank) { plugin_.forget(rank); }
  /// Waits a little; longer the more often in a row.
  void pause();

 private:
  using Clock = std::chrono::steady_clock;
  [[nodiscard]] bool take_next(Message& message);

  const mpi::Plugin& plugin_;
  std::uint32_t serial_;  ///< of this multistart in the process
  std::vector<Clock::time_point> heard_;
  Clock::time_point last_beat_;
  int pauses_ = 0;
};

/// Results as bytes, for another process of the same program on the same kind of machine.
[[nodiscard]] std::vector<char> to_bytes(const Result& result);
[[nodiscard]] std::vector<char> to_bytes(const MultistartResult& result);
[[nodiscard]] std::vector<char> to_bytes(const WorstCaseProof& proof);
[[nodiscard]] WorstCaseProof proof_from(std::span<const char> bytes);
[[nodiscard]] Result result_from(std::span<const char> bytes);
[[nodiscard]] MultistartResult multistart_result_from(std::span<const char> bytes);

}  // namespace ipminmax
