// Options: registered from the core's table, read from files, copied back with their types.
#include <unistd.h>

#include <gtest/gtest.h>

#include <IpJournalist.hpp>
#include <clocale>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <limits>
#include <locale>
#include <sstream>

#include "adapter/ipopt/application_options.hpp"
#include "adapter/ipopt/exact_options.hpp"
#include "adapter/ipopt/ipopt_only_options.hpp"
#include "adapter/ipopt/minmax_application.hpp"
#include "adapter/model.hpp"

namespace ipminmax {
namespace {

using Ipopt::SmartPtr;

class Options : public testing::Test {
 protected:
  Options() { register_options(*registry); }

  std::string read(const std::string& text) {
    std::istringstream input(text);
    return read_options(input, "file.opt", *registry, *list);
  }
  SolverOptions values() {
    SolverOptions options;
    EXPECT_EQ(solver_options(*list, options), "");
    return options;
  }

  SmartPtr<Ipopt::Journalist> journalist = new Ipopt::Journalist();
  SmartPtr<Ipopt::RegisteredOptions> registry = new Ipopt::RegisteredOptions();
  SmartPtr<Ipopt::OptionsList> list = new Ipopt::OptionsList(registry, journalist);
};

TEST_F(Options, EveryOptionOfTheCoreIsRegisteredWithItsDefault) {
  const SolverOptions defaults;
  for (const OptionInfo& info : option_table()) {
    const std::string name(info.name);
    const SmartPtr<const Ipopt::RegisteredOption> option = registry->GetOption(name);
    ASSERT_TRUE(IsValid(option)) << name;
    if (const auto* number = std::get_if<OptionInfo::Number>(&info.kind)) {
      EXPECT_EQ(option->DefaultNumber(), defaults.*(number->member)) << name;
    } else if (const auto* integer = std::get_if<OptionInfo::Integer>(&info.kind)) {
      EXPECT_EQ(option->DefaultInteger(), defaults.*(integer->member)) << name;
    } else if (const auto* flag = std::get_if<OptionInfo::Flag>(&info.kind)) {
      EXPECT_EQ(option->DefaultString(), defaults.*(flag->member) ? "yes" : "no") << name;
    } else {
      const auto& choice = std::get<OptionInfo::Choice>(info.kind);
      EXPECT_EQ(option->DefaultString(), choice.names[choice.get(defaults)]) << name;
    }
  }
}

// Whatever is registered comes back into SolverOptions: every option is set to another value.
TEST_F(Options, EveryOptionOfTheCoreIsCopied) {
  SolverOptions expected;
  for (const OptionInfo& info : option_table()) {
    const std::string name(info.name);
    if (const auto* number = std::get_if<OptionInfo::Number>(&info.kind)) {
      const double value = number->lower >= 0 ? 0.25 : -8.0;
      if (!registry->GetOption(name)->IsValidNumberSetting(value)) continue;
      list->SetNumericValue(name, value);
      expected.*(number->member) = value;
    } else if (const auto* integer = std::get_if<OptionInfo::Integer>(&info.kind)) {
      list->SetIntegerValue(name, 7);
      expected.*(integer->member) = 7;
    } else if (const auto* flag = std::get_if<OptionInfo::Flag>(&info.kind)) {
      bool& value = expected.*(flag->member);
      value = !value;
      list->SetStringValue(name, value ? "yes" : "no");
    } else {
      const auto& choice = std::get<OptionInfo::Choice>(info.kind);
      list->SetStringValue(name, std::string(choice.names.back()));
      choice.set(expected, choice.names.size() - 1);
    }
  }
  SolverOptions options;
  static_cast<void>(solver_options(*list, options));  // values may contradict each other
  for (const OptionInfo& info : option_table()) {
    if (const auto* number = std::get_if<OptionInfo::Number>(&info.kind)) {
      EXPECT_EQ(options.*(number->member), expected.*(number->member)) << info.name;
    } else if (const auto* integer = std::get_if<OptionInfo::Integer>(&info.kind)) {
      EXPECT_EQ(options.*(integer->member), expected.*(integer->member)) << info.name;
    } else if (const auto* flag = std::get_if<OptionInfo::Flag>(&info.kind)) {
      EXPECT_EQ(options.*(flag->member), expected.*(flag->member)) << info.name;
    } else {
      const auto& choice = std::get<OptionInfo::Choice>(info.kind);
      EXPECT_EQ(choice.get(options), choice.get(expected)) << info.name;
    }
  }
}

TEST_F(Options, DefaultsAreTheCores) {
  const SolverOptions options = values();
  EXPECT_EQ(options.tol, SolverOptions{}.tol);
  EXPECT_EQ(options.perturb_dec_fact, 1.0 / 3.0);  // all digits
}

TEST_F(Options, AsPrintedChangesOnlyWhatIsNotSet) {
  ASSERT_EQ(read("minmax_as_printed yes\nperturb_inc_fact 4\nkappa_sigma 1e6\ntol 1e-5\n"), "");
  const SolverOptions options = values();
  SolverOptions expected = as_printed();
  EXPECT_EQ(options.minmax_globalization, Globalization::None);
  EXPECT_EQ(options.minmax_barrier_rule, expected.minmax_barrier_rule);
  EXPECT_EQ(options.bound_mult_init_method, expected.bound_mult_init_method);
  EXPECT_EQ(options.constr_mult_init_max, 0.0);
  EXPECT_EQ(options.perturb_inc_fact_first, expected.perturb_inc_fact_first);
  EXPECT_EQ(options.perturb_inc_fact, 4.0);
  EXPECT_EQ(options.kappa_sigma, 1e6);
  EXPECT_EQ(options.tol, 1e-5);
}

TEST_F(Options, ReadsAFileAsIpoptDoes) {
  ASSERT_EQ(read("# a comment\n"
                 "tol 1d-6   max_iter\t17 # another\r\n"
                 "\n"
                 "warm_start_init_point YES\n"
                 "\"linear_solver\" \"mumps\"\n"
                 "mu_init\n2.5D-1\n"
                 "print_level +3"),
            "");
  const SolverOptions options = values();
  EXPECT_EQ(options.tol, 1e-6);
  EXPECT_EQ(options.max_iter, 17);
  EXPECT_TRUE(options.warm_start_init_point);
  EXPECT_EQ(options.linear_solver, LinearSolver::Mumps);
  EXPECT_EQ(options.mu_init, 0.25);
}

TEST_F(Options, FileErrorsNameTheLineAndTheOption) {
  EXPECT_EQ(read("tol 1e-6\n\nmu_int 0.1\n"),
            "file.opt, line 3: unknown option \"mu_int\"; did you mean mu_init?");
  EXPECT_EQ(read("mu_init -1"), "file.opt, line 1: mu_init = -1 is not in (0, inf)");
  EXPECT_EQ(read("\nmu_init nan"), "file.opt, line 2: mu_init = nan is not in (0, inf)");
  EXPECT_EQ(read("mu_init inf"), "file.opt, line 1: mu_init = inf is not in (0, inf)");
  EXPECT_EQ(read("bound_frac 0.7"), "file.opt, line 1: bound_frac = 0.7 is not in (0, 0.5]");
  EXPECT_EQ(read("mu_init small"), "file.opt, line 1: mu_init = small is not a number");
  EXPECT_EQ(read("mu_init 1e-1x"), "file.opt, line 1: mu_init = 1e-1x is not a number");
  EXPECT_EQ(read("max_iter 1e3"), "file.opt, line 1: max_iter = 1e3 is not an integer");
  EXPECT_EQ(read("max_iter 99999999999"),
            "file.opt, line 1: max_iter = 99999999999 is not an integer");
  EXPECT_EQ(read("max_iter -1"), "file.opt, line 1: max_iter = -1 is not in [0, inf)");
  EXPECT_EQ(read("print_level 13"), "file.opt, line 1: print_level = 13 is not in [0, 12]");
  EXPECT_EQ(read("nlp_scaling_method some"),
            "file.opt, line 1: nlp_scaling_method = some is not one of: none gradient-based "
            "user-scaling");
  EXPECT_EQ(read("tol 1e-7\nmax_iter"), "file.opt, line 2: option \"max_iter\" has no value");
  EXPECT_EQ(read("tol \"1e-7\nmax_iter 3"), "file.opt, line 1: a quotation never ends");
}

TEST_F(Options, AFileValueStays) {
  ASSERT_EQ(read("max_iter 17"), "");
  EXPECT_TRUE(list->SetIntegerValue("max_iter", 18));  // as in Ipopt: true, and no effect
  EXPECT_EQ(values().max_iter, 17);
  EXPECT_EQ(read("max_iter 17"), "");
}

TEST_F(Options, NaNIsFoundOut) {
  list->SetNumericValue("tol", std::numeric_limits<double>::quiet_NaN());
  SolverOptions options;
  EXPECT_NE(solver_options(*list, options).find("tol = "), std::string::npos);
}

// --- Through the application ---------------------------------------------------------------------

class OptionFile : public testing::Test {
 protected:
  // Named after the test: tests run at the same time.
  OptionFile()
      : name(testing::TempDir() + "ipminmax_" +
             testing::UnitTest::GetInstance()->current_test_info()->name() + ".opt") {}
  ~OptionFile() override { std::remove(name.c_str()); }
  void write(const std::string& text) { std::ofstream(name) << text; }

  Ipopt::Index max_iter() {
    Ipopt::Index value = 0;
    app->Options()->GetIntegerValue("max_iter", value, "");
    return value;
  }

  std::string name;
  SmartPtr<MinMaxApplication> app = new MinMaxApplication(false);
};

TEST_F(OptionFile, IsReadWhenNamed) {
  write("max_iter 11\n");
  EXPECT_EQ(app->Initialize(name), Ipopt::Solve_Succeeded);
  EXPECT_EQ(max_iter(), 11);
}

TEST_F(OptionFile, IsReadWhenNamedByAnOption) {
  write("max_iter 12\n");
  app->Options()->SetStringValue("option_file_name", name);
  EXPECT_EQ(app->Initialize(), Ipopt::Solve_Succeeded);
  EXPECT_EQ(max_iter(), 12);
}

TEST_F(OptionFile, AStringLiteralIsAFileName) {
  EXPECT_EQ(app->Initialize("no such file.opt"), Ipopt::Invalid_Option);
  EXPECT_EQ(app->LastResult().message, "the options file \"no such file.opt\" cannot be opened");
}

TEST_F(OptionFile, MayOnlyBeMissingWhenNobodyNamedIt) {
  EXPECT_EQ(app->Initialize(), Ipopt::Solve_Succeeded);  // no ipminmax.opt here
  EXPECT_EQ(app->Initialize(""), Ipopt::Solve_Succeeded);
  EXPECT_EQ(app->Initialize(std::string()), Ipopt::Solve_Succeeded);
  app->Options()->SetStringValue("option_file_name", "");
  EXPECT_EQ(app->Initialize(), Ipopt::Solve_Succeeded);
  app->Options()->SetStringValue("option_file_name", name);
  EXPECT_EQ(app->Initialize(), Ipopt::Invalid_Option);
  EXPECT_EQ(app->LastResult().message, "the options file \"" + name + "\" cannot be opened");
}

TEST_F(OptionFile, IsNoFolder) {
  EXPECT_EQ(app->Initialize(testing::TempDir()), Ipopt::Invalid_Option);
  EXPECT_EQ(app->LastResult().message, testing::TempDir() + " cannot be read");
}

/// In a child without privileges, which may read everything; a file that opens but cannot be read.
TEST_F(OptionFile, MustBeReadable) {
  write("max_iter 11\n");
  std::filesystem::permissions(name, std::filesystem::perms::none);
  const auto refused_without_privileges = [&] {
    constexpr uid_t kNobody = 65534;
    if (geteuid() == 0 && setresuid(kNobody, kNobody, kNobody) != 0) std::_Exit(2);
    const bool refused =
        app->Initialize(name) == Ipopt::Invalid_Option &&
        app->LastResult().message == "the options file \"" + name + "\" cannot be opened";
    std::_Exit(refused ? 0 : 1);
  };
  EXPECT_EXIT(refused_without_privileges(), testing::ExitedWithCode(0), "");
  constexpr const char* kUnreadable = "/proc/self/mem";  // nothing at address 0
  EXPECT_EQ(app->Initialize(kUnreadable), Ipopt::Invalid_Option);
  EXPECT_EQ(app->LastResult().message, std::string(kUnreadable) + " cannot be read");
}

TEST_F(OptionFile, MayBeOverriddenWhereThatIsAllowed) {
  write("max_iter 11\n");
  EXPECT_EQ(app->Initialize(name, true), Ipopt::Solve_Succeeded);
  app->Options()->SetIntegerValue("max_iter", 12);
  EXPECT_EQ(max_iter(), 12);
  const SmartPtr<MinMaxApplication> strict = new MinMaxApplication(false);
  EXPECT_EQ(strict->Initialize(name), Ipopt::Solve_Succeeded);
  strict->Options()->SetIntegerValue("max_iter", 12);
  Ipopt::Index value = 0;
  strict->Options()->GetIntegerValue("max_iter", value, "");
  EXPECT_EQ(value, 11);
}

TEST_F(OptionFile, NumbersKeepAllDigits) {
  const double number = 123456789.0 + 1.0 / 3.0;
  app->Options()->SetNumericValue("diverging_iterates_tol", number);
  double value = 0.0;
  ASSERT_TRUE(app->Options()->GetNumericValue("diverging_iterates_tol", value, ""));
  EXPECT_EQ(value, number);
  write("tol 1.23456789012345678e-9\nmu_init 1.5d-03\n");
  ASSERT_EQ(app->Initialize(name), Ipopt::Solve_Succeeded);
  app->Options()->GetNumericValue("tol", value, "");
  EXPECT_EQ(value, 1.23456789012345678e-9);
  app->Options()->GetNumericValue("mu_init", value, "");
  EXPECT_EQ(value, 1.5e-3);
  const SmartPtr<MinMaxApplication> other = app->clone();
  other->Options()->GetNumericValue("diverging_iterates_tol", value, "");
  EXPECT_EQ(value, number);
  // What a file has set stays.
  app->Options()->SetNumericValue("tol", 2e-9);
  app->Options()->GetNumericValue("tol", value, "");
  EXPECT_EQ(value, 1.23456789012345678e-9);
}

/// A locale with a decimal comma, as of the C library where one can be made, and of streams.
class CommaLocale {
 public:
  CommaLocale() : before_(std::locale::global(std::locale(std::locale::classic(), new Comma))) {
    const std::string folder = testing::TempDir() + "ipminmax_locales";
    std::filesystem::create_directories(folder);
    const std::string make = "localedef -i de_DE -f UTF-8 " + folder + "/de_DE.UTF-8 2>/dev/null";
    static_cast<void>(std::system(make.c_str()));
    setenv("LOCPATH", folder.c_str(), 1);
    of_the_library = std::setlocale(LC_ALL, "de_DE.UTF-8") != nullptr;
  }
  ~CommaLocale() {
    std::setlocale(LC_ALL, "C");
    unsetenv("LOCPATH");
    std::locale::global(before_);
  }
  bool of_the_library = false;

 private:
  struct Comma : std::numpunct<char> {
    [[nodiscard]] char do_decimal_point() const override { return ','; }
    [[nodiscard]] char do_thousands_sep() const override { return '.'; }
    [[nodiscard]] std::string do_grouping() const override { return "\3"; }
  };
  std::locale before_;
};

TEST_F(OptionFile, HasDecimalPointsInEveryLocale) {
  const CommaLocale locale;
  RecordProperty("locale_of_the_library", locale.of_the_library ? "yes" : "no");
  write("tol 1.5e-09\nmax_iter 1234\n");
  ASSERT_EQ(app->Initialize(name), Ipopt::Solve_Succeeded) << app->LastResult().message;
  double value = 0.0;
  app->Options()->GetNumericValue("tol", value, "");
  EXPECT_EQ(value, 1.5e-9);
  app->Options()->SetNumericValue("mu_init", 0.0625);
  app->Options()->GetNumericValue("mu_init", value, "");
  EXPECT_EQ(value, 0.0625);
  EXPECT_EQ(max_iter(), 1234);
  const SmartPtr<MinMaxApplication> other = new MinMaxApplication(false);
  write("tau_min 1.5\n");
  EXPECT_EQ(other->Initialize(name), Ipopt::Invalid_Option);
  EXPECT_EQ(other->LastResult().message, name + ", line 1: tau_min = 1.5 is not in (0, 1)");
  const SmartPtr<Model> model = new Model;
  EXPECT_EQ(app->OptimizeTNLP(new SplitTNLP(GetRawPtr(model), {1})), Ipopt::Solve_Succeeded);
}

TEST_F(OptionFile, ErrorsAreInvalidOption) {
  for (const char* text : {"mu_int 0.1\n", "tol -1\n", "tol nan\n", "max_iter many\n"}) {
    write(text);
    const SmartPtr<MinMaxApplication> fresh = new MinMaxApplication(false);
    EXPECT_EQ(fresh->Initialize(name), Ipopt::Invalid_Option) << text;
  }
}

TEST_F(OptionFile, CanBeReadAgain) {
  write("max_iter 11\n");
  EXPECT_EQ(app->Initialize(name), Ipopt::Solve_Succeeded);
  EXPECT_EQ(app->Initialize(name), Ipopt::Solve_Succeeded);
  EXPECT_EQ(max_iter(), 11);
  write("max_iter 11\nbad 1\n");
  EXPECT_EQ(app->Initialize(name), Ipopt::Invalid_Option);
}

TEST_F(OptionFile, ErrorsAreSaidOnTheConsole) {
  write("tol 1e-6\nmu_int 0.1\n");
  testing::internal::CaptureStdout();
  {
    const SmartPtr<MinMaxApplication> loud = new MinMaxApplication;
    EXPECT_EQ(loud->Initialize(name), Ipopt::Invalid_Option);
    loud->Jnlst()->FlushBuffer();
  }
  EXPECT_EQ(
      testing::internal::GetCapturedStdout(),
      "Invalid option: " + name + ", line 2: unknown option \"mu_int\"; did you mean mu_init?\n");
}

TEST_F(OptionFile, WrongSetCallsReturnFalse) {
  EXPECT_FALSE(app->Options()->SetNumericValue("no_option", 1.0));
  EXPECT_FALSE(app->Options()->SetNumericValue("tol", -1.0));
  EXPECT_FALSE(app->Options()->SetStringValue("tol", "1"));
  EXPECT_TRUE(app->Options()->SetNumericValue("tol", 1e-5));
}

TEST_F(OptionFile, NaNStopsTheSolve) {
  app->Options()->SetNumericValue("tol", std::numeric_limits<double>::quiet_NaN());
  EXPECT_EQ(app->Initialize(""), Ipopt::Invalid_Option);
  const SmartPtr<Model> model = new Model;
  EXPECT_EQ(app->OptimizeTNLP(GetRawPtr(model)), Ipopt::Invalid_Option);
  EXPECT_EQ(app->LastResult().status, Status::InvalidOption);
  EXPECT_NE(app->LastResult().message.find("tol"), std::string::npos);
  EXPECT_TRUE(model->calls.empty());
}

/// Counts the values that it is asked for.
class CountingList : public ExactOptionsList {
 public:
  using ExactOptionsList::ExactOptionsList;
  bool GetStringValue(const std::string& tag, std::string& value,
                      const std::string& prefix) const override {
    ++asked;
    return ExactOptionsList::GetStringValue(tag, value, prefix);
  }
  bool GetIntegerValue(const std::string& tag, Ipopt::Index& value,
                       const std::string& prefix) const override {
    ++asked;
    return ExactOptionsList::GetIntegerValue(tag, value, prefix);
  }
  bool GetNumericValue(const std::string& tag, Ipopt::Number& value,
                       const std::string& prefix) const override {
    ++asked;
    return ExactOptionsList::GetNumericValue(tag, value, prefix);
  }
  mutable int asked = 0;
};

/// Options read from lists of the application's own class.
class OwnList : public Options {
 protected:
  double tolerance() {
    SolverOptions options;
    EXPECT_EQ(solver_options(*own, options), "");
    return options.tol;
  }
  SmartPtr<CountingList> own = new CountingList(registry, journalist);
};

// Every solve reads them: hundreds of look-ups by name would take longer than a small problem.
TEST_F(OwnList, OnlyOptionsThatMayBeSetAreAskedFor) {
  own->SetNumericValue("tol", 1e-5);
  own->SetStringValue("mu_oracle", "probing");
  own->asked = 0;
  EXPECT_EQ(tolerance(), 1e-5);
  EXPECT_TRUE(ignored_ipopt_options(*own).empty());
  EXPECT_LE(own->asked, 6);
}

TEST_F(OwnList, EveryWayToSetAnOptionIsSeen) {
  own->SetNumericValue("tol", 1e-3);
  EXPECT_EQ(tolerance(), 1e-3);
  own->clear();
  EXPECT_EQ(tolerance(), SolverOptions().tol);
  own->SetNumericValueIfUnset("tol", 1e-4);
  EXPECT_EQ(tolerance(), 1e-4);
  own->clear();
  std::istringstream text("tol 1e-5\nma57_pivtol 0.25\n");
  ASSERT_TRUE(own->ReadFromStream(*journalist, text));
  EXPECT_EQ(tolerance(), 1e-5);
  EXPECT_EQ(ignored_ipopt_options(*own).size(), 1U);
  const SmartPtr<ExactOptionsList> twin = new ExactOptionsList(registry, journalist);
  twin->copy(*own);
  EXPECT_EQ(ignored_ipopt_options(*twin).size(), 1U);
  own->clear();
  list->SetNumericValue("tol", 1e-6);
  static_cast<Ipopt::OptionsList&>(*own) = *list;
  EXPECT_EQ(tolerance(), 1e-6);
  twin->copy(*list);
  SolverOptions options;
  EXPECT_EQ(solver_options(*twin, options), "");
  EXPECT_EQ(options.tol, 1e-6);
}

}  // namespace
}  // namespace ipminmax
