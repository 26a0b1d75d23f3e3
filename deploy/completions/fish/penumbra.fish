# SPDX-License-Identifier: Apache-2.0
set -l commands render submit status list watch cancel workers serve version
complete -c penumbra -n "not __fish_seen_subcommand_from $commands" -f -a "$commands"
complete -c penumbra -n "__fish_seen_subcommand_from render" -s o -l output -r -d "image file"
complete -c penumbra -n "__fish_seen_subcommand_from render submit" -l samples -x -d "per pixel"
complete -c penumbra -n "__fish_seen_subcommand_from render submit" -l size -x -d "WxH in pixels"
complete -c penumbra -n "__fish_seen_subcommand_from render submit" -l crop -x -d "L,T,R,B in pixels"
complete -c penumbra -n "__fish_seen_subcommand_from render submit" -l seed -x
complete -c penumbra -n "__fish_seen_subcommand_from render submit" -l mode -x -a "uniform edge adaptive interleaved"
complete -c penumbra -n "__fish_seen_subcommand_from render submit" -l aperture-radius -x -d "of the lens"
complete -c penumbra -n "__fish_seen_subcommand_from render submit" -l focus-distance -x
complete -c penumbra -n "__fish_seen_subcommand_from render submit" -l time -x -d "second at which the shutter opens"
complete -c penumbra -n "__fish_seen_subcommand_from render submit" -l shutter -x -d "seconds that it is open"
complete -c penumbra -n "__fish_seen_subcommand_from render submit" -l background -x -d "R,G,B"
complete -c penumbra -n "__fish_seen_subcommand_from render serve" -l processes -x
complete -c penumbra -n "__fish_seen_subcommand_from render serve" -l isa -x -a "v2 v3 v4"
complete -c penumbra -n "__fish_seen_subcommand_from render watch" -l quiet
complete -c penumbra -n "__fish_seen_subcommand_from submit status list watch cancel workers" -l server -x
complete -c penumbra -n "__fish_seen_subcommand_from serve" -l listen -x
complete -c penumbra -n "__fish_seen_subcommand_from serve" -l worker-listen -x
complete -c penumbra -n "__fish_seen_subcommand_from serve" -l data -r
complete -c penumbra -n "__fish_seen_subcommand_from serve" -l tile -x
complete -c penumbra -n "__fish_seen_subcommand_from serve" -l log-level -x -a "error warning info debug"
complete -c penumbra -l json -d "print JSON"
complete -c penumbra -l help
