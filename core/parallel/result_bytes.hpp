#pragma once

#include <span>
#include <vector>

#include "core/multistart.hpp"
#include "core/result.hpp"

namespace ipminmax {

/// Results as bytes, for another process of the same program on the same kind of machine.
[[nodiscard]] std::vector<char> to_bytes(const Result& result);
[[nodiscard]] std::vector<char> to_bytes(const MultistartResult& result);
[[nodiscard]] std::vector<char> to_bytes(const WorstCaseProof& proof);
[[nodiscard]] WorstCaseProof proof_from(std::span<const char> bytes);
[[nodiscard]] Result result_from(std::span<const char> bytes);
[[nodiscard]] MultistartResult multistart_result_from(std::span<const char> bytes);

}  // namespace ipminmax
