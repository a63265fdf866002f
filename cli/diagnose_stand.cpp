#include "cli/diagnose_stand.hpp"

#include <cstdio>

#include "bench/stand/stand_text.hpp"
#include "host/base/error.hpp"

namespace rotorloop::cli {

void diagnose_stand_files(const DiagnoseStandOptions& o) {
  if (o.mapping.empty())
    throw Error({"--mapping", "is missing: the columns of a stand file have no meaning without it", "",
                 "give -m MAPPING.toml (docs/files.md, Stand mapping; examples in vehicles/measured/stands)"});
  bench::StandDiagnosisOptions options;
  options.seed = o.seed;
  const bench::StandDiagnosis d = bench::diagnose_stands(o.files, bench::read_stand_mapping(o.mapping), options);
  const std::string text = o.json ? bench::stand_json(d) : bench::stand_text(d);
  std::fwrite(text.data(), 1, text.size(), stdout);
}

}  // namespace rotorloop::cli
