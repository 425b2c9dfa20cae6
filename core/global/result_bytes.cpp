#include "core/global/result_bytes.hpp"

#include <cstdint>
#include <cstring>
#include <string>
#include <type_traits>

namespace ipminmax {
namespace {

/// The same walk over a value's members writes them and reads them.
class Writer {
 public:
  template <class T>
  requires std::is_trivially_copyable_v<T>
  void operator()(const T& value) { append(&value, sizeof value); }
  template <class T>
  void operator()(const std::vector<T>& values) {
    (*this)(static_cast<std::uint64_t>(values.size()));
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
    std::uint64_t size = 0;
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
  write(static_cast<std::uint64_t>(values.size()));
}
template <class T>
void walk_size(Reader& read, std::vector<T>& values) {
  std::uint64_t size = 0;
  read(size);
  values.resize(size);
}

template <class Visit, class C>
void walk_certificate(Visit& visit, C& c) {
  visit(c.kind);
  visit(c.second_order);
  visit(c.inner);
  visit(c.inner_expected);
  visit(c.full);
  visit(c.full_expected);
  visit(c.margin);
  visit(c.licq_min);
  visit(c.licq_max);
  visit(c.weakly_active_min);
  visit(c.weakly_active_max);
  visit(c.finite_differences);
  visit(c.hessian_error);
  visit(c.hessian_disagrees);
  visit(c.least_curvature);
  visit(c.least_curvature_variable);
  visit(c.answer);
  walk_size(visit, c.reasons);
  for (auto& reason : c.reasons) {
    visit(reason.kind);
    visit(reason.player);
    visit(reason.text);
    visit(reason.variables);
    visit(reason.constraints);
  }
}

template <class Visit, class R>
void walk(Visit& visit, R& result) {
  visit(result.status);
  walk_certificate(visit, result.certificate);
  visit(result.message);
  visit(result.v);
  visit(result.lambda);
  visit(result.z_lower);
  visit(result.z_upper);
  visit(result.constraints);
  visit(result.objective);
  visit(result.objective_scale);
  visit(result.fixed_variables_relaxed);
  visit(result.error);
  visit(result.mu);
  visit(result.iterations);
  visit(result.factorizations);
  visit(result.seconds);
  visit(result.cpu_seconds);
  visit(result.counts);
  visit(result.timing);
  auto& worst = result.worst_case;
  visit(worst.starts);
  visit(worst.maxima);
  visit(worst.competing);
  visit(worst.value);
  visit(worst.v);
  visit(worst.y);
  visit(worst.branches);
  visit(worst.higher);
  visit(worst.unbounded);
  visit(worst.single_branch);
  visit(worst.stated_concave);
  walk_size(visit, result.worst_cases);
  for (auto& found : result.worst_cases) {
    visit(found.constraint);
    visit(found.v);
    visit(found.value);
    visit(found.multiplier);
    visit(found.active);
  }
  visit(result.over_y);
  visit(result.over_x);
}

template <class Visit, class M>
void walk_answer(Visit& visit, M& answer) {
  walk(visit, answer.best);
  visit(answer.best_start);
  visit(answer.starts);
  visit(answer.interrupted);
  walk_size(visit, answer.points);
  for (auto& point : answer.points) {
    walk(visit, point.result);
    visit(point.first_start);
    visit(point.found);
  }
  walk_size(visit, answer.statuses);
  for (auto& [status, count] : answer.statuses) {
    visit(status);
    visit(count);
  }
}

}  // namespace

std::vector<char> to_bytes(const Result& result) {
  Writer write;
  walk(write, result);
  return std::move(write.bytes);
}

Result result_from(std::span<const char> bytes) {
  Reader read(bytes);
  Result result;
  walk(read, result);
  return result;
}

std::vector<char> to_bytes(const MultistartResult& answer) {
  Writer write;
  walk_answer(write, answer);
  return std::move(write.bytes);
}

MultistartResult multistart_result_from(std::span<const char> bytes) {
  Reader read(bytes);
  MultistartResult answer;
  walk_answer(read, answer);
  return answer;
}

}  // namespace ipminmax
