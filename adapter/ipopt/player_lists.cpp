#include <algorithm>
#include <utility>

#include "adapter/ipopt/concat.hpp"
#include "adapter/ipopt/exact_options.hpp"
#include "adapter/ipopt/player_lists.hpp"
#include "linalg/numbers.hpp"

namespace ipminmax {
inline namespace IPMINMAX_IPOPT_ABI {
namespace {

bool is_separator(char c) { return c == ',' || c == ' ' || (c >= '\t' && c <= '\r'); }

/// The next entry of the list, taken off its front; empty at the end. Names like x[1,'New York']
/// hold separators inside brackets and quotes.
std::string_view take_entry(std::string_view& list) {
  while (!list.empty() && is_separator(list.front())) list.remove_prefix(1);
  std::size_t end = 0;
  int depth = 0;
  for (char quote = '\0'; end < list.size(); ++end) {
    const char c = list[end];
    if (quote != '\0') {
      if (c == quote) quote = '\0';
    } else if (depth > 0 && (c == '\'' || c == '"')) {
      quote = c;
    } else if (c == '[' || c == '(') {
      ++depth;
    } else if (c == ']' || c == ')') {
      --depth;
    } else if (depth <= 0 && is_separator(c)) {
      break;
    }
  }
  const std::string_view entry = list.substr(0, end);
  list.remove_prefix(end);
  return entry;
}

bool is_digits(std::string_view text) {
  return !text.empty() && std::ranges::all_of(text, [](char c) { return c >= '0' && c <= '9'; });
}

std::string add_range(std::string_view first, std::string_view last, const ListedItems& items,
                      std::vector<Index>& indices) {
  const auto begin = parse_integer(first), end = parse_integer(last);
  for (const auto& [text, i] : {std::pair(first, begin), std::pair(last, end)}) {
    if (!i || *i >= items.count)
      return concat("there is no ", items.what, " ", text, ": the model has ", items.count, " ",
                    items.what, "s, counted from 0");
  }
  if (*end < *begin) return concat("the range ", first, "-", last, " runs backwards");
  for (Index i = *begin; i <= *end; ++i) indices.push_back(i);
  return {};
}

std::string add_named(std::string_view name, const ListedItems& items,
                      std::vector<Index>& indices) {
  if (items.names == nullptr || items.names->empty()) {
    const std::string reason =
        items.names_given > 0 ? concat("gives ", items.names_given, " names for ", items.count, " ")
                              : "names no ";
    return concat("\"", name, "\" is no index and no range, and the model ", reason, items.what,
                  "s");
  }
  bool found = false;
  for (std::size_t i = 0; i < items.names->size(); ++i) {
    const std::string_view candidate = (*items.names)[i];
    if (!candidate.starts_with(name)) continue;
    if (candidate.size() > name.size() && candidate[name.size()] != '[') continue;
    indices.push_back(static_cast<Index>(i));
    found = true;
  }
  return found ? "" : concat("there is no ", items.what, " named \"", name, "\"");
}

std::string description(Index i, const ListedItems& items) {
  const bool named = items.names != nullptr && !items.names->empty();
  return concat(items.what, " ", i, named ? " (" + (*items.names)[at(i)] + ")" : "");
}

const char* name_of(Player player) { return player == Player::Max ? "Max" : "Min"; }

}  // namespace

std::string read_index_list(std::string_view list, const ListedItems& items,
                            std::vector<Index>& indices) {
  indices.clear();
  for (auto entry = take_entry(list); !entry.empty(); entry = take_entry(list)) {
    const std::size_t dash = std::min(entry.find('-'), entry.size());
    const std::string_view first = entry.substr(0, dash);
    const std::string_view last = dash < entry.size() ? entry.substr(dash + 1) : first;
    std::string error = is_digits(first) && is_digits(last) ? add_range(first, last, items, indices)
                                                            : add_named(entry, items, indices);
    if (!error.empty()) return error;
  }
  std::ranges::sort(indices);
  const auto repeated = std::ranges::adjacent_find(indices);
  if (repeated != indices.end()) return description(*repeated, items) + " is listed twice";
  return {};
}

PlayerOptions player_options(const Ipopt::OptionsList& list) {
  PlayerOptions options;
  read_option(list, "minmax_max_variables", options.max_variables);
  read_option(list, "minmax_max_constraints", options.max_constraints);
  read_option(list, "minmax_min_constraints", options.min_constraints);
  return options;
}

std::string apply_player_option(std::string_view option, std::string_view list,
                                const ListedItems& items, const StatedPlayers& stated,
                                std::vector<Player>& players) {
  std::vector<Index> indices;
  if (const auto error = read_index_list(list, items, indices); !error.empty())
    return concat("option ", option, ": ", error);
  if (indices.empty()) return {};
  std::vector<Player> listed = stated.implied;
  for (const Index i : indices) listed[at(i)] = Player::Max;
  if (players != stated.implied) {
    const auto [ours, theirs] = std::ranges::mismatch(listed, players);
    if (ours != listed.end()) {
      return concat("option ", option, " gives ",
                    description(static_cast<Index>(ours - listed.begin()), items), " to ",
                    name_of(*ours), ", ", stated.source, " gives it to ", name_of(*theirs));
    }
  }
  players = std::move(listed);
  return {};
}

std::string apply_min_constraints(const PlayerOptions& options, const ListedItems& items,
                                  std::vector<Player>& players) {
  std::vector<Index> to_min, to_max;
  const std::string error = read_index_list(options.min_constraints, items, to_min);
  if (!error.empty()) return "option minmax_min_constraints: " + error;
  if (to_min.empty()) return {};
  static_cast<void>(read_index_list(options.max_constraints, items, to_max));
  for (const Index j : to_min) {
    if (std::ranges::binary_search(to_max, j)) {
      return "options minmax_min_constraints and minmax_max_constraints both list " +
             description(j, items);
    }
    players[at(j)] = Player::Min;
  }
  return {};
}

}  // namespace IPMINMAX_IPOPT_ABI
}  // namespace ipminmax
