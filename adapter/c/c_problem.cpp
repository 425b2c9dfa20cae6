#include "adapter/c/c_problem.hpp"

#include <array>
#include <cstdio>
#include <cstring>

#include "adapter/ipopt/exact_options.hpp"

namespace ipminmax {
inline namespace IPMINMAX_IPOPT_ABI {
namespace {

/// Message of calls without a problem; no allocation, so that it can report out of memory.
thread_local std::array<char, 512> creation_message{};

void say_without_problem(const char* text) noexcept {
  std::snprintf(creation_message.data(), creation_message.size(), "%s", text);
}

}  // namespace

void say(IpminmaxProblemInfo* problem, std::string text) noexcept {
  if (problem == nullptr) return say_without_problem(text.c_str());
  problem->fixed_message = nullptr;
  problem->message = std::move(text);
}

void say_fixed(IpminmaxProblemInfo* problem, const char* text) noexcept {
  if (problem == nullptr) return say_without_problem(text);
  problem->fixed_message = text;
}

const char* message_without_problem() noexcept { return creation_message.data(); }

std::vector<double> read_array(const double* values, Index count, const char* name,
                               bool may_be_null) {
  if (count <= 0 || (values == nullptr && may_be_null)) return {};
  if (values == nullptr) refuse(name, " is NULL");
  std::vector<double> result(values, values + count);
  const auto nan = std::ranges::find_if(result, [](double v) { return v != v; });
  if (nan != result.end()) refuse(name, "[", nan - result.begin(), "] is NaN");
  return result;
}

bool asks_for_hessian(const IpminmaxProblemInfo& problem) {
  std::string source = "exact";
  read_option(*problem.application->Options(), "hessian_approximation", source);
  return source == "exact";
}

void write_sized(const void* from, std::size_t known, void* to, std::size_t size) {
  known = std::min(known, size);
  std::memcpy(to, from, known);
  std::memset(static_cast<char*>(to) + known, 0, size - known);
}

}  // namespace IPMINMAX_IPOPT_ABI
}  // namespace ipminmax
