// The list of options, docs/options.md, and what becomes of options that only Ipopt has.
//
// To renew docs/options.md after a change of the tables:
//     IPMINMAX_WRITE_DOCS=1 build/tests/adapter_options_documentation_test
#include <algorithm>
#include <array>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <regex>
#include <set>
#include <sstream>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include <gtest/gtest.h>

#include <IpIpoptApplication.hpp>
#include <IpJournalist.hpp>

#include "adapter/ipopt/application_options.hpp"
#include "adapter/ipopt/ipopt_only_options.hpp"
#include "adapter/ipopt/minmax_application.hpp"
#include "adapter/ipopt/option_registry.hpp"
#include "adapter/ipopt/options_documentation.hpp"
#include "adapter/model.hpp"

namespace ipminmax {
namespace {

using Ipopt::SmartPtr;

bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

const OptionInfo& documented(const std::string& name) {
  static const std::vector<OptionInfo> all = list_options();
  for (const OptionInfo& option : all) {
    if (option.name == name) return option;
  }
  throw std::out_of_range(name);
}

TEST(ListOptions, HoldsEveryOptionOnceWithAText) {
  std::set<std::string_view> names;
  std::set<std::string_view> closed;
  std::string_view category;
  for (const OptionInfo& option : list_options()) {
    EXPECT_TRUE(names.insert(option.name).second) << option.name;
    EXPECT_FALSE(option.text.empty()) << option.name;
    EXPECT_EQ(option.text.back(), '.') << option.name;
    if (option.category != category) {
      EXPECT_TRUE(closed.insert(option.category).second) << option.category << " comes twice";
      category = option.category;
    }
  }
  EXPECT_EQ(names.size(), option_table().size() + application_option_table().size());
}

TEST(ListOptions, AgreesWithTheRegistry) {
  const SmartPtr<Ipopt::RegisteredOptions> registry = new Ipopt::RegisteredOptions();
  register_options(*registry);
  for (const OptionInfo& option : list_options()) {
    const SmartPtr<const Ipopt::RegisteredOption> registered =
        registry->GetOption(std::string(option.name));
    ASSERT_TRUE(Ipopt::IsValid(registered)) << option.name;
    if (type_of(option) == "number") {
      EXPECT_EQ(std::stod(default_of(option)), registered->DefaultNumber()) << option.name;
    } else if (type_of(option) == "integer") {
      EXPECT_EQ(std::stoi(default_of(option)), registered->DefaultInteger()) << option.name;
    } else {
      EXPECT_EQ(default_of(option), registered->DefaultString()) << option.name;
      EXPECT_EQ(registered->Type(), Ipopt::OT_String) << option.name;
    }
    const auto* choice = std::get_if<OptionInfo::Choice>(&option.kind);
    if (choice == nullptr) continue;
    for (const std::string_view value : choice->names) {
      EXPECT_TRUE(registered->IsValidStringSetting(std::string(value))) << option.name;
    }
  }
}

TEST(ListOptions, ShowsTypeRangeAndDefault) {
  EXPECT_EQ(type_of(documented("tol")), "number");
  EXPECT_EQ(range_of(documented("tol")), "(0, inf)");
  EXPECT_EQ(default_of(documented("tol")), "1e-08");
  EXPECT_EQ(range_of(documented("bound_frac")), "(0, 0.5]");
  EXPECT_EQ(range_of(documented("max_iter")), "[0, inf)");
  EXPECT_EQ(range_of(documented("print_level")), "[0, 12]");
  EXPECT_EQ(default_of(documented("perturb_dec_fact")), "0.3333333333333333");
  EXPECT_EQ(type_of(documented("sb")), "yes/no");
  EXPECT_EQ(default_of(documented("linear_solver")), "auto");
  EXPECT_EQ(std::get<OptionInfo::Choice>(documented("linear_solver").kind).names.size(), 10U)
      << "without Ipopt's own";
  EXPECT_EQ(default_of(documented("option_file_name")), "ipminmax.opt");
}

TEST(OptionsText, IsReadableOnATerminal) {
  const std::string text = options_text();
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) EXPECT_LE(line.size(), 100U) << line;
  EXPECT_TRUE(contains(text, "### Termination ###"));
  EXPECT_TRUE(contains(text, "tol                              number in (0, inf)"));
  EXPECT_TRUE(contains(text, "      mumps: MUMPS, sparse with pivoting\n"));
  for (const char c : text) EXPECT_TRUE(c == '\n' || (c >= ' ' && c <= '~'));
}

/// Markdown: a bar would end the cell, < could begin a tag.
std::string escaped(std::string_view text) {
  std::string result;
  for (const char c : text) {
    if (c == '|' || c == '*' || c == '<') result += '\\';
    result += c;
  }
  return result;
}

std::string code(const std::string& text) { return text.empty() ? "" : "`" + text + "`"; }

std::string markdown_row(const OptionInfo& option) {
  std::string text = escaped(option.text);
  if (const auto* choice = std::get_if<OptionInfo::Choice>(&option.kind)) {
    for (std::size_t i = 0; i < choice->names.size(); ++i) {
      const std::string meaning = escaped(choice->texts[i]);
      text +=
          "<br>" + code(std::string(choice->names[i])) + (meaning.empty() ? "" : ": " + meaning);
    }
  }
  return "| `" + std::string(option.name) + "` | " + values_of(option) + " | " +
         code(default_of(option)) + " | " + text + " |\n";
}

std::string advice_table(const std::vector<IpoptOptionAdvice>& table) {
  std::string text = "\n| option | what to know |\n|---|---|\n";
  const std::vector<OptionInfo> options = list_options();
  for (const IpoptOptionAdvice& row : table) {
    std::string names;
    for (const std::string_view name : row.names) {
      if (std::ranges::find(options, name, &OptionInfo::name) == options.end())
        names += (names.empty() ? "`" : ", `") + std::string(name) + "`";
    }
    if (!names.empty()) text += "| " + names + " | " + escaped(row.advice) + " |\n";
  }
  return text;
}

/// The list of options as a page with a table per category, and what becomes of options that only
/// Ipopt has.
std::string options_markdown() {
  std::string text =
      "# Options\n\n"
      "Names, values and defaults are Ipopt's if the meaning is Ipopt's. Options that Ipopt does "
      "not have\nbegin with `minmax_`. [`glossary.md`](glossary.md) explains K and K_yy, "
      "[`algorithm.md`](algorithm.md) names the paper.\n"
      "`print_options_documentation yes` prints this list. Set options so:\n\n"
      "| from | how |\n|---|---|\n"
      "| C++ | `app->Options()->SetNumericValue(name, value)`, `SetIntegerValue`, "
      "`SetStringValue` |\n"
      "| C++ core | members of `SolverOptions`: those about the method ([`core.md`](core.md)) |\n"
      "| Python | `options={\"tol\": 1e-9}` |\n"
      "| C, CasADi, Pyomo | `IpminmaxAddNumOption(problem, name, value)`; `{\"ipminmax\": {name: "
      "value}}`; `solver.options[name] = value` |\n"
      "| a file | one `name value` per line in `ipminmax.opt` of the working folder, a value with "
      "blanks in double quotes. It has the last word, but not for the executable "
      "([`ampl.md`](ampl.md)) |\n"
      "| the executable | `name=value` on the command line, quoted for the shell if the value has "
      "blanks |\n\n"
      "Made from the table of options in `core/options.cpp` and "
      "`adapter/ipopt/application_options.cpp`;\n"
      "do not edit (`tests/adapter/options_documentation_test.cpp` says how to renew it).\n";
  std::string_view category;
  for (const OptionInfo& option : list_options()) {
    if (option.category != category) {
      category = option.category;
      text += "\n## " + std::string(category) +
              "\n\n| option | value | default | meaning |\n|---|---|---|---|\n";
    }
    text += markdown_row(option);
  }
  text +=
      "\n## Options that only Ipopt has\n\n"
      "They are known by name, whichever version of Ipopt is linked, so that programs and options\n"
      "files made for Ipopt say what became of them. Setting one to Ipopt's default does "
      "nothing.\n\n"
      "Refused (`Invalid_Option`), because they change the problem or what the answer means:\n";
  text += advice_table(refused_ipopt_option_advice());
  text +=
      "\nAccepted with a message, because they only steer Ipopt's own algorithm; `*` stands for "
      "any\n"
      "ending, and every other option that Ipopt knows is of this kind:\n";
  text += advice_table(ignored_ipopt_option_advice());
  text +=
      "\nA `linear_solver` that only Ipopt has (`ma27`, `ma86`, `wsmp`, ...) is accepted with "
      "a\n"
      "message and means `auto`.\n";
  return text;
}

TEST(OptionsMarkdown, IsThePageInDocs) {
  const std::string path = std::string(IPMINMAX_SOURCE_DIR) + "/docs/options.md";
  if (std::getenv("IPMINMAX_WRITE_DOCS") != nullptr) std::ofstream(path) << options_markdown();
  std::ifstream file(path);
  std::stringstream page;
  page << file.rdbuf();
  EXPECT_EQ(page.str(), options_markdown()) << "the head of this file says how to renew the page";
}

TEST(OptionsMarkdown, EveryRowHasFourCells) {
  std::istringstream lines(options_markdown());
  for (std::string line; std::getline(lines, line);) {
    if (!line.starts_with("| `")) continue;
    int bars = 0;
    for (std::size_t i = 0; i < line.size(); ++i)
      bars += line[i] == '|' && line[i - (i > 0)] != '\\';
    EXPECT_TRUE(bars == 5 || bars == 3) << line;
  }
}

// Words of a page that look like options of ours: `minmax_starts 8`. minmax_result is a suffix.
TEST(Pages, NameOptionsThatExist) {
  const SmartPtr<Ipopt::RegisteredOptions> registry = new Ipopt::RegisteredOptions();
  register_options(*registry);
  const std::regex option("`(minmax_[a-z_]*[a-z])");
  std::set<std::string> seen;
  for (const auto& page :
       std::filesystem::directory_iterator(std::string(IPMINMAX_SOURCE_DIR) + "/docs")) {
    if (page.path().extension() != ".md") continue;
    std::ifstream file(page.path());
    std::stringstream text;
    text << file.rdbuf();
    const std::string words = text.str();
    for (std::sregex_iterator at(words.begin(), words.end(), option), end; at != end; ++at) {
      const std::string name = (*at)[1];
      seen.insert(name);
      EXPECT_TRUE(name == "minmax_result" || Ipopt::IsValid(registry->GetOption(name)))
          << name << " in " << page.path();
    }
  }
  EXPECT_GT(seen.size(), 20U);
}

// --- Through the application ---------------------------------------------------------------------

using Settings = std::vector<std::pair<std::string, std::string>>;

struct Solved {
  Ipopt::ApplicationReturnStatus initialized = Ipopt::Internal_Error;
  Ipopt::ApplicationReturnStatus status = Ipopt::Internal_Error;
  std::string console;
};

Solved run(const Settings& settings) {
  Solved result;
  testing::internal::CaptureStdout();
  {
    const SmartPtr<MinMaxApplication> app = new MinMaxApplication;
    std::ostringstream text;
    for (const auto& [name, value] : settings) text << name << " \"" << value << "\"\n";
    std::istringstream input(text.str());
    result.initialized = app->Initialize(input);
    const SmartPtr<Ipopt::TNLP> model = new SplitTNLP(new Model, {1});
    result.status = app->OptimizeTNLP(model);
    app->Jnlst()->FlushBuffer();
  }
  result.console = testing::internal::GetCapturedStdout();
  return result;
}

TEST(PrintOptionsDocumentation, PrintsTheListOnce) {
  const std::string text = run({{"print_options_documentation", "yes"}}).console;
  const std::size_t first = text.find("### Termination ###");
  ASSERT_NE(first, std::string::npos);
  EXPECT_EQ(text.find("### Termination ###", first + 1), std::string::npos);
  EXPECT_TRUE(contains(text, "minmax_curvature_tol"));
  EXPECT_FALSE(contains(run({}).console, "### Termination ###"));
}

TEST(PrintUserOptions, SaysWhatIsUsed) {
  const std::string text = run({{"print_user_options", "yes"},
                                {"tol", "1e-7"},
                                {"max_iter", "50"},
                                {"linear_solver", "lapack"},
                                {"quality_function_max_section_steps", "4"}})
                               .console;
  const auto line = [&](const std::string& name) {
    const std::size_t begin = text.find("\n" + name + " ");
    if (begin == std::string::npos) return std::string();
    return text.substr(begin + 1, text.find('\n', begin + 1) - begin - 1);
  };
  for (const char* name : {"tol", "max_iter", "linear_solver", "print_user_options"}) {
    EXPECT_TRUE(line(name).ends_with(" yes")) << name << ": " << line(name);
  }
  EXPECT_TRUE(contains(line("tol"), "1e-07"));
  EXPECT_TRUE(contains(line("linear_solver"), "lapack"));
  const std::string ignored = line("quality_function_max_section_steps");
  EXPECT_TRUE(ignored.ends_with(" no")) << ignored;
  EXPECT_EQ(line("mu_init"), "");
}

TEST(IpoptOnlyOptions, ThatSteerIpoptsAlgorithmAreAcceptedAndNamed) {
  for (const auto& [name, value, part] :
       std::vector<std::tuple<std::string, std::string, std::string>>{
           {"quality_function_max_section_steps", "4", "mu_oracle"},
           {"sigma_max", "10", "mu_oracle"},
           {"max_soc", "0", "Ipopt's own algorithm"},
           {"watchdog_shortened_iter_trigger", "3", "Ipopt's own algorithm"},
           {"ma57_pivtol", "1e-06", "grows from 1e-8 to 1e-4"},
           {"ma27_pivtol", "1e-06", "linear solver that is not built in"},
           {"linear_solver", "ma57", "auto is used"},
           {"recalc_y", "yes", "Ipopt's own algorithm"},
           {"hessian_constant", "yes", "evaluated anew"},
           {"accept_every_trial_step", "yes", "minmax_globalization none"}}) {
    const Solved result = run({{name, value}});
    EXPECT_EQ(result.initialized, Ipopt::Solve_Succeeded) << name;
    EXPECT_EQ(result.status, Ipopt::Solve_Succeeded) << name;
    EXPECT_TRUE(contains(result.console, "Option " + name + " = " + value + " has no effect"))
        << name << '\n'
        << result.console;
    EXPECT_TRUE(contains(result.console, part)) << result.console;
  }
}

TEST(IpoptOnlyOptions, AtIpoptsDefaultSayNothing) {
  const Solved result = run({{"mu_strategy", "monotone"},
                             {"hessian_approximation", "exact"},
                             {"max_soc", "4"},
                             {"fixed_variable_treatment", "make_parameter"},
                             {"derivative_test", "none"}});
  EXPECT_EQ(result.status, Ipopt::Solve_Succeeded);
  EXPECT_FALSE(contains(result.console, "has no effect")) << result.console;
}

TEST(IpoptOnlyOptions, ThatChangeTheQuestionAreRefused) {
  for (const auto& [name, value] : Settings{{"jacobian_approximation", "finite-difference-values"},
                                            {"nlp_scaling_obj_target_gradient", "1"},
                                            {"warm_start_entire_iterate", "yes"}}) {
    const Solved result = run({{name, value}});
    EXPECT_EQ(result.initialized, Ipopt::Invalid_Option) << name;
    EXPECT_EQ(result.status, Ipopt::Invalid_Option) << name;
    EXPECT_TRUE(contains(result.console, name + " = " + value)) << result.console;
    EXPECT_TRUE(contains(result.console, "not available")) << result.console;
  }
}

TEST(IpoptOnlyOptions, KeepIpoptsRangesAndValues) {
  for (const auto& [name, value] : Settings{{"fixed_mu_oracle", "clever"}, {"max_soc", "-1"}}) {
    const Solved result = run({{name, value}});
    EXPECT_EQ(result.initialized, Ipopt::Invalid_Option) << name;
    EXPECT_TRUE(contains(result.console, name + " = " + value + " is not ")) << result.console;
  }
  const Solved solver = run({{"linear_solver", "gauss"}});
  EXPECT_TRUE(contains(solver.console,
                       "linear_solver = gauss is not one of: auto mumps ldlt lapack mumps_mpi ma57 "
                       "spral pardiso pardisomkl ma97\n"))
      << solver.console;
  EXPECT_TRUE(contains(run({{"mu_strateggy", "adaptive"}}).console, "unknown option"));
}

// A library that is named has to be there; where it is, it factorizes (calling conventions by stand-ins).
TEST(LoadedSolvers, FromALibraryThatAnOptionNames) {
  for (const auto& [solver, option, library] :
       {std::array{"ma57", "hsllib", IPMINMAX_MA57_STAND_IN},
        std::array{"ma97", "hsllib", IPMINMAX_MA97_STAND_IN},
        std::array{"pardiso", "pardisolib", IPMINMAX_PARDISO_STAND_IN},
        std::array{"pardisomkl", "pardisolib", IPMINMAX_PARDISO_STAND_IN}}) {
    const Solved solved =
        run({{"linear_solver", solver}, {option, library}, {"print_ipopt_log", "yes"}});
    EXPECT_EQ(solved.status, Ipopt::Solve_Succeeded) << solved.console;
    EXPECT_FALSE(contains(solved.console, "has no effect")) << solved.console;
    EXPECT_TRUE(contains(solved.console, std::string("linear solver ") + solver + "."))
        << solved.console;
  }
  for (const auto& [solver, option] : Settings{{"ma57", "hsllib"},
                                               {"ma97", "hsllib"},
                                               {"spral", "minmax_spral_library"},
                                               {"pardiso", "pardisolib"},
                                               {"pardisomkl", "pardisolib"}}) {
    const Solved refused = run({{"linear_solver", solver}, {option, "/nowhere/lib.so"}});
    EXPECT_EQ(refused.status, Ipopt::Invalid_Option) << refused.console;
    EXPECT_TRUE(contains(refused.console, option + " = /nowhere/lib.so cannot be used"))
        << refused.console;
  }
  const Solved wrong =
      run({{"linear_solver", "spral"}, {"minmax_spral_library", IPMINMAX_MA57_STAND_IN}});
  EXPECT_EQ(wrong.status, Ipopt::Invalid_Option);
  EXPECT_TRUE(contains(wrong.console, "has no function spral_ssids_factor_ptr32")) << wrong.console;
}

TEST(IpoptOnlyOptions, SetByCallAreHandledAlike) {
  const SmartPtr<MinMaxApplication> app = new MinMaxApplication(false);
  EXPECT_TRUE(app->Options()->SetStringValue("fixed_mu_oracle", "loqo"));
  EXPECT_TRUE(app->Options()->SetStringValue("linear_solver", "ma27"));
  EXPECT_EQ(app->Initialize(""), Ipopt::Solve_Succeeded);
  EXPECT_EQ(ignored_ipopt_options(*app->Options()).size(), 2U);
  const SmartPtr<Ipopt::TNLP> model = new SplitTNLP(new Model, {1});
  EXPECT_EQ(app->OptimizeTNLP(model), Ipopt::Solve_Succeeded);
  app->Options()->SetStringValue("jacobian_approximation", "finite-difference-values");
  EXPECT_EQ(app->OptimizeTNLP(model), Ipopt::Invalid_Option);
  EXPECT_TRUE(contains(app->LastResult().message, "eval_jac_g"));
}

// Every option that Ipopt knows is ours or known by name.
// Advice on an option that this solver has, too, is never given and misleads in the documentation.
TEST(IpoptOnlyOptions, EveryAdviceIsOnAnOptionThatOnlyIpoptHas) {
  // Ipopt 3.14's, which the registry has only where that is built with.
  const std::set<std::string_view> newer = {"gradient_approximation", "spral_*", "hsllib",
                                            "pardisomkl_*", "grad_f_constant"};
  // Ipopt 3.11's, which 3.14 has no more.
  const std::set<std::string_view> older = {"ma28_*", "print_options_latex_mode"};
  const auto covers = [&](std::string_view pattern) {
    if (IPMINMAX_IPOPT_AT_LEAST(3, 14) && older.contains(pattern)) return true;
    if (newer.contains(pattern)) return true;
    const bool many = pattern.ends_with('*');
    if (many) pattern.remove_suffix(1);
    for (const OptionInfo& option : ipopt_only_options()) {
      const std::string_view name = option.name;
      if (many ? name.starts_with(pattern) : name == pattern) return true;
    }
    return false;
  };
  for (const auto* table : {&refused_ipopt_option_advice(), &ignored_ipopt_option_advice()}) {
    for (const IpoptOptionAdvice& row : *table)
      for (const std::string_view name : row.names) EXPECT_TRUE(covers(name)) << name;
  }
}

TEST(IpoptOnlyOptions, NoneOfIpoptsIsUnknown) {
  const SmartPtr<Ipopt::RegisteredOptions> ipopt = new Ipopt::RegisteredOptions();
  Ipopt::IpoptApplication::RegisterAllIpoptOptions(ipopt);
  const SmartPtr<Ipopt::RegisteredOptions> registry = new Ipopt::RegisteredOptions();
  register_options(*registry);
  ASSERT_GT(ipopt->RegisteredOptionsList().size(), 200U);
  for (const auto& [name, option] : ipopt->RegisteredOptionsList()) {
    const SmartPtr<const Ipopt::RegisteredOption> own = registry->GetOption(name);
    ASSERT_TRUE(Ipopt::IsValid(own)) << name;
    EXPECT_EQ(own->Type(), option->Type()) << name;
  }
}

}  // namespace
}  // namespace ipminmax
