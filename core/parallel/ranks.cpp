#include "core/parallel/ranks.hpp"

#include <algorithm>
#include <cstring>
#include <deque>
#include <string>
#include <thread>
#include <type_traits>
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

namespace {

/// The same walk over a value's members writes them and reads them.
class Writer {
 public:
  template <class T>
  requires std::is_trivially_copyable_v<T>
  void operator()(const T& value) { append(&value, sizeof value); }
  template <class T>
  void operator()(const std::vector<T>& values) {
    (*this)(values.size());
    append(values.data(), values.size() * sizeof(T));
  }
  void operator()(const std::string& text) { (*this)(std::vector<char>(text.begin(), text.end())); }
  std::vector<char> bytes;

 private:
  void append(const void* from, std::size_t count) {
    if (count == 0) return;
    const std::size_t size = bytes.size();
    bytes.resize(size + count);
    std::memcpy(bytes.data() + size, from, count);
  }
};

class Reader {
 public:
  explicit Reader(std::span<const char> bytes) : rest_(bytes) {}
  template <class T>
  requires std::is_trivially_copyable_v<T>
  void operator()(T& value) { take(&value, sizeof value); }
  template <class T>
  void operator()(std::vector<T>& values) {
    std::size_t size = 0;
    (*this)(size);
    values.resize(size);
    take(values.data(), size * sizeof(T));
  }
  void operator()(std::string& text) {
    std::vector<char> letters;
    (*this)(letters);
    text.assign(letters.begin(), letters.end());
  }

 private:
  void take(void* to, std::size_t count) {
    if (count == 0) return;
    std::memcpy(to, rest_.data(), count);
    rest_ = rest_.subspan(count);
  }
  std::span<const char> rest_;
};

/// The number of values whose members follow.
template <class T>
void walk_size(Writer& write, const std::vector<T>& values) {
  write(values.size());
}
template <class T>
void walk_size(Reader& read, std::vector<T>& values) {
  std::size_t size = 0;
  read(size);
  values.resize(size);
}

template <class Visit, class... Values>
void each(Visit& visit, Values&... values) {
  (visit(values), ...);
}

/// T itself, or const.
template <class Own, class T>
concept Of = std::is_same_v<std::remove_const_t<Own>, T>;

template <class Visit, Of<Certificate> C>
void walk(Visit& visit, C& c) {
  each(visit, c.kind, c.second_order, c.inner, c.inner_expected, c.full, c.full_expected, c.margin,
       c.licq_min, c.licq_max, c.weakly_active_min, c.weakly_active_max, c.finite_differences,
       c.hessian_error, c.hessian_disagrees, c.least_curvature, c.least_curvature_variable,
       c.answer, c.proved, c.proved_within, c.proof);
  walk_size(visit, c.reasons);
  for (auto& r : c.reasons) each(visit, r.kind, r.player, r.text, r.variables, r.constraints);
}

template <class Visit, Of<WorstCaseProof> P>
void walk(Visit& visit, P& p) {
  each(visit, p.constraint, p.least, p.seen, p.proved, p.resolution, p.complete, p.empty, p.v,
       p.boxes, p.left, p.seconds, p.interrupted, p.message);
}

template <class Visit, Of<Result> R>
void walk(Visit& visit, R& r) {
  visit(r.status);
  walk(visit, r.certificate);
  each(visit, r.message, r.v, r.lambda, r.z_lower, r.z_upper, r.constraints, r.objective,
       r.objective_scale, r.fixed_variables_relaxed, r.error, r.mu, r.iterations, r.factorizations,
       r.seconds, r.cpu_seconds, r.counts, r.timing, r.over_x);
  auto& worst = r.worst_case;
  each(visit, worst.starts, worst.maxima, worst.competing, worst.value, worst.v, worst.y,
       worst.branches, worst.higher, worst.unbounded, worst.single_branch, worst.stated_concave);
  auto& y = r.over_y;
  each(visit, y.asked, y.functions, y.maximizations, y.finished, y.better_known,
       y.largest_violation, y.age, y.branches, y.solves, y.open, y.open_constraint);
  walk_size(visit, y.proofs);
  for (auto& p : y.proofs) walk(visit, p);
  walk_size(visit, r.worst_cases);
  for (auto& found : r.worst_cases) {
    each(visit, found.constraint, found.v, found.value, found.multiplier, found.active, found.side,
         found.range, found.age);
  }
}

template <class Visit, Of<MultistartResult> M>
void walk(Visit& visit, M& answer) {
  walk(visit, answer.best);
  each(visit, answer.best_start, answer.starts, answer.interrupted);
  walk_size(visit, answer.points);
  for (auto& point : answer.points) {
    walk(visit, point.result);
    each(visit, point.first_start, point.found);
  }
  walk_size(visit, answer.statuses);
  for (auto& [status, count] : answer.statuses) each(visit, status, count);
}

template <class T>
std::vector<char> written(const T& value) {
  Writer write;
  walk(write, value);
  return std::move(write.bytes);
}

template <class T>
T read_from(std::span<const char> bytes) {
  Reader read(bytes);
  T value;
  walk(read, value);
  return value;
}

}  // namespace

std::vector<char> to_bytes(const Result& result) { return written(result); }
Result result_from(std::span<const char> bytes) { return read_from<Result>(bytes); }

std::vector<char> to_bytes(const WorstCaseProof& proof) { return written(proof); }
WorstCaseProof proof_from(std::span<const char> bytes) { return read_from<WorstCaseProof>(bytes); }

std::vector<char> to_bytes(const MultistartResult& answer) { return written(answer); }
MultistartResult multistart_result_from(std::span<const char> bytes) {
  return read_from<MultistartResult>(bytes);
}

}  // namespace ipminmax
