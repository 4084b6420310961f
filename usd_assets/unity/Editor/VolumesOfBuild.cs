// SPDX-License-Identifier: Apache-2.0
using System.Collections.Generic;
using System.IO;
using System.Linq;
using UnityEditor;
using UnityEditor.Build;
using UnityEngine;

namespace StereoCell.Editor
{
    /// <summary>Adds the voxel files of the specimens in a player to its streaming assets. The project's own folder
    /// StreamingAssets stays as it is.</summary>
    public sealed class VolumesOfBuild : BuildPlayerProcessor
    {
        public override void PrepareForBuild(BuildPlayerContext buildPlayerContext)
        {
            foreach (var path in FilesOf(buildPlayerContext.BuildPlayerOptions.scenes))
            {
                buildPlayerContext.AddAdditionalPathToStreamingAssets(path, VolumePlace.Folder + "/" + Path.GetFileName(path));
            }
        }

        /// <summary>The voxel files of all boxes to which these scenes and the project's Resources folders refer.</summary>
        public static IEnumerable<string> FilesOf(string[] scenes)
        {
            var roots = new List<string>(scenes ?? new string[0]);
            foreach (var folder in Directory.GetDirectories("Assets", "Resources", SearchOption.AllDirectories))
            {
                roots.AddRange(Directory.GetFiles(folder, "*", SearchOption.AllDirectories).Where(path => !path.EndsWith(".meta")).Select(path => path.Replace('\\', '/')));
            }
            var found = new SortedSet<string>();
            foreach (var asset in AssetDatabase.GetDependencies(roots.ToArray(), true))
            {
                if (!asset.EndsWith("." + SpecimenImporter.Ending, System.StringComparison.Ordinal)) continue;
                var specimen = AssetDatabase.LoadAssetAtPath<GameObject>(asset);
                if (specimen == null) throw new BuildFailedException(asset + " was not imported. The console shows the reason.");
                foreach (var box in specimen.GetComponentsInChildren<VolumeBox>(true)) found.Add(VolumeCache.MakerOf(box)());
            }
            return found;
        }
    }
}
