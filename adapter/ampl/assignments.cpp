#include "assignments.hpp"

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <ostream>
#include <stdexcept>

#include <IpJournalist.hpp>

#include "adapter/ipopt/application_options.hpp"
#include "adapter/ipopt/concat.hpp"
#include "adapter/ipopt/exact_options.hpp"

namespace ipminmax {
namespace {

/// Whether two texts are the same value.
bool same_value(const std::string& a, const std::string& b) {
  return a == b || (parse_number(a) && parse_number(a) == parse_number(b));
}

}  // namespace

void Assignments::add_argument(const std::string& text) {
  const std::size_t equal = text.find('=');
  if (equal == std::string::npos || equal == 0 || equal + 1 == text.size())
    throw std::invalid_argument("bad assignment \"" + text + "\": expected name=value");
  std::string value = text.substr(equal + 1);
  // Pyomo quotes values, and no shell takes the quotes off.
  const char quote = value.front();
  if (value.size() > 1 && (quote == '"' || quote == '\'') && value.back() == quote)
    value = value.substr(1, value.size() - 2);
  add(text.substr(0, equal), value, Source::CommandLine);
}

void Assignments::add_environment(const std::string& text) {
  const std::string blanks = " \t\n\v\f\r";
  std::size_t at = 0;
  const auto skip_blanks = [&] { at = std::min(text.find_first_not_of(blanks, at), text.size()); };
  const auto word = [&](const std::string& ends) {
    const std::size_t begin =
        std::exchange(at, std::min(text.find_first_of(ends, at), text.size()));
    return text.substr(begin, at - begin);
  };
  for (skip_blanks(); at < text.size(); skip_blanks()) {
    const std::string name = word(blanks + "=");
    skip_blanks();
    if (at < text.size() && text[at] == '=') ++at;
    skip_blanks();
    if (name.empty() || at == text.size())
      throw std::invalid_argument(concat(kEnvironment, ": option \"", name, "\" has no value"));
    const char quote = text[at];
    const bool quoted = quote == '"' || quote == '\'';
    if (quoted && text.find(quote, ++at) == std::string::npos)
      throw std::invalid_argument(concat(kEnvironment, ": a quotation never ends"));
    add(name, word(quoted ? std::string(1, quote) : blanks), Source::Environment);
    if (quoted) ++at;
  }
}

void Assignments::report_overridden(std::ostream& out) const {
  for (const auto& [name, all] : given_) {
    const Given& last = winner(all);
    for (const Given& given : all) {
      if (same_value(given.value, last.value)) continue;
      out << "ipminmax: " << name << " = " << last.value << " (" << place(last.source)
          << ") overrides " << given.value << " (" << place(given.source) << ")\n";
    }
  }
}

int Assignments::take_integer(const std::string& name, int missing, int lower, int upper) {
  const auto given = value(name);
  if (!given) return missing;
  const auto number = parse_integer(*given);
  if (!number || *number < lower || *number > upper)
    throw std::invalid_argument(
        concat(name, " = ", *given, " is not an integer in [", lower, ", ", upper, "]"));
  given_.erase(name);
  return *number;
}

bool Assignments::take_flag(const std::string& name) {
  const auto given = value(name);
  if (!given) return false;
  if (*given != "yes" && *given != "no")
    throw std::invalid_argument(name + " = " + *given + " is not one of: no yes");
  given_.erase(name);
  return *given == "yes";
}

void add_file(RegisteredOptions& registry, Assignments& assignments) {
  const auto named = assignments.value("option_file_name");
  const std::string name = named.value_or("ipminmax.opt");
  if (name.empty() || (!named && !std::filesystem::exists(name))) return;
  std::ifstream file(name);
  const bool is_folder = std::filesystem::is_directory(name);
  if (is_folder || !file.is_open())
    throw std::invalid_argument("cannot read the options file " + name + ": " +
                                (is_folder ? "it is a folder" : std::strerror(errno)));
  // Ipopt's list keeps the first of several values in a file, and says so.
  const Ipopt::SmartPtr<Ipopt::Journalist> journalist = new Ipopt::Journalist;
  journalist->AddFileJournal("errors", "stderr", Ipopt::J_WARNING);
  const Ipopt::SmartPtr<OptionsList> list = new ExactOptionsList(&registry, journalist);
  const std::string error = read_options(file, name, registry, *list);
  if (!error.empty()) throw std::invalid_argument(error);
  assignments.name_file(name);
  for (const auto table : option_tables()) {
    for (const OptionInfo& option : table)
      if (const auto value = value_of(option, *list))
        assignments.add(std::string(option.name), *value, Source::File);
  }
}

}  // namespace ipminmax
