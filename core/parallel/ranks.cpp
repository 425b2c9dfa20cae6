#include "core/parallel/ranks.hpp"

#include <algorithm>
#include <cstring>
#include <deque>
#include <thread>
#include <utility>

#include "linalg/mpi_library.hpp"
#include "linalg/symmetric_solver.hpp"

namespace ipminmax {
namespace {

struct Header {
  std::uint32_t kind;
  std::uint32_t serial;
  std::int32_t start;
  std::int32_t unused = 0;
  std::uint64_t bytes;
};

/// Messages of a later multistart, which another rank has begun already.
struct Early {
  std::uint32_t serial;
  Ranks::Message message;
};
std::deque<Early>& early() {
  static std::deque<Early> process_wide;
  return process_wide;
}

std::uint32_t next_serial() {
  static std::uint32_t last = 0;
  return ++last;
}

const mpi::Plugin& joined() {
  const mpi::Plugin& plugin = mpi_plugin();
  if (const char* error = plugin.join(mpi::Role::Starts, library_version())) {
    throw SolverUnavailable(error);
  }
  return plugin;
}

}  // namespace

std::string what_of(const std::exception_ptr& exception) {
  try {
    std::rethrow_exception(exception);
  } catch (const std::exception& error) {
    return error.what();
  } catch (...) {
    return "unknown exception";
  }
}

Ranks::Ranks()
    : plugin_(joined()),
      serial_(next_serial()),
      heard_(static_cast<std::size_t>(plugin_.size()), Clock::now()) {}

Ranks::Place Ranks::join() {
  const mpi::Plugin& plugin = joined();
  return {plugin.rank(), plugin.size()};
}

void Ranks::send(int rank, Kind kind, Index start, std::span<const char> bytes) {
  Header header{static_cast<std::uint32_t>(kind), serial_, start, 0, bytes.size()};
  std::vector<char> message(sizeof header + bytes.size());
  std::memcpy(message.data(), &header, sizeof header);
  if (!bytes.empty()) std::memcpy(message.data() + sizeof header, bytes.data(), bytes.size());
  plugin_.send(rank, message.data(), message.size());
}

void Ranks::send_to_others(Kind kind, Index start, std::span<const char> bytes) {
  for (int other = 1; other < size(); ++other) send(other, kind, start, bytes);
}

/// The next message of this multistart; those of later ones are put aside.
bool Ranks::take_next(Message& message) {
  const auto mine = std::ranges::find(early(), serial_, &Early::serial);
  if (mine != early().end()) {
    message = std::move(mine->message);
    early().erase(mine);
    return true;
  }
  int rank = 0;
  std::size_t count = 0;
  while (plugin_.poll(&rank, &count)) {
    std::vector<char> bytes(count);
    if (!plugin_.receive(bytes.data())) continue;
    Header header;
    std::memcpy(&header, bytes.data(), sizeof header);
    heard_[static_cast<std::size_t>(rank)] = Clock::now();
    const auto begin = bytes.begin() + sizeof header;
    message = {rank,
               static_cast<Kind>(header.kind),
               header.start,
               {begin, begin + static_cast<std::ptrdiff_t>(header.bytes)}};
    if (header.serial == serial_) return true;
    if (header.serial > serial_) early().push_back({header.serial, std::move(message)});
  }
  return false;
}

std::optional<Ranks::Message> Ranks::receive() {
  Message message;
  while (take_next(message)) {
    pauses_ = 0;
    if (message.kind != Kind::Beat) return message;
  }
  return std::nullopt;
}

void Ranks::beat() {
  const auto now = Clock::now();
  if (now - last_beat_ < std::chrono::seconds(1)) return;
  last_beat_ = now;
  if (rank() != 0) return send(0, Kind::Beat);
  send_to_others(Kind::Beat);
}

bool Ranks::is_lost(int rank, double seconds) const {
  const std::chrono::duration<double> silence =
      Clock::now() - heard_[static_cast<std::size_t>(rank)];
  return plugin_.gone(rank) || silence.count() > seconds;
}

void Ranks::pause() {
  constexpr int kLongest = 2000;  // microseconds
  std::this_thread::sleep_for(std::chrono::microseconds(std::min(20 * ++pauses_, kLongest)));
}

}  // namespace ipminmax
