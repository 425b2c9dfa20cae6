#pragma once

#include <memory>
#include <string>

#include <IpIpoptApplication.hpp>

#include <ipminmax/adapter/minmax_tnlp.hpp>
#include <ipminmax/core/result.hpp>

namespace ipminmax {
inline namespace IPMINMAX_IPOPT_ABI {

/// Ipopt's IpoptApplication with a player split: porting a program is changing this type's name.
class MinMaxApplication : public Ipopt::ReferencedObject {
 public:
  explicit MinMaxApplication(bool create_console_out = true);
  ~MinMaxApplication() override;

  MinMaxApplication(const MinMaxApplication&) = delete;
  MinMaxApplication& operator=(const MinMaxApplication&) = delete;

  /// Reads ipminmax.opt (or the file named by option_file_name) when present.
  Ipopt::ApplicationReturnStatus Initialize();
  /// Reads the given options file; "" reads none.
  Ipopt::ApplicationReturnStatus Initialize(const std::string& options_file);
  Ipopt::ApplicationReturnStatus Initialize(const char* options_file);

  Ipopt::SmartPtr<Ipopt::OptionsList> Options();
  Ipopt::SmartPtr<Ipopt::Journalist> Jnlst();
  Ipopt::SmartPtr<Ipopt::RegisteredOptions> RegOptions();

  /// A MinMaxTNLP, or a plain TNLP: then a minimization, or split by the integer metadata "player".
  Ipopt::ApplicationReturnStatus OptimizeTNLP(const Ipopt::SmartPtr<Ipopt::TNLP>& model);
  /// The model of the last OptimizeTNLP again, with the same structure.
  Ipopt::ApplicationReturnStatus ReOptimizeTNLP(const Ipopt::SmartPtr<Ipopt::TNLP>& model);

  /// Answer of the last solve, with the certificate.
  [[nodiscard]] const Result& LastResult() const;

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace IPMINMAX_IPOPT_ABI
}  // namespace ipminmax
