#include "cli/diagnose_stand.hpp"

#include <fmt/format.h>

#include <cstdio>

#include "bench/stand/evaluate/stand_text.hpp"
#include "host/base/error.hpp"

namespace rotorloop::cli {

void diagnose_stand_files(const DiagnoseStandOptions& o) {
  if (!o.idle_options.empty())
    throw Error({fmt::format("{}", fmt::join(o.idle_options, ", ")), "not offered for files of a thrust stand (--stand)",
                 "they are read through --mapping alone; there is no flight, no vehicle and no report of them",
                 "leave out what is named; --json > result.json keeps the result"});
  if (o.mapping.empty())
    throw Error({"--mapping", "is missing: the columns of a stand file have no meaning without it", "",
                 "give -m MAPPING.toml (docs/files.md, Stand mapping; examples in vehicles/measured/stands)"});
  stand::StandDiagnosisOptions options;
  options.seed = o.seed;
  const stand::StandDiagnosis d = stand::diagnose_stands(o.files, stand::read_stand_mapping(o.mapping), options);
  const std::string text = o.json ? stand::stand_json(d) : stand::stand_text(d);
  std::fwrite(text.data(), 1, text.size(), stdout);
}

}  // namespace rotorloop::cli
