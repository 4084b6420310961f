// SPDX-License-Identifier: Apache-2.0
using System;
using System.IO;
using UnityEditor;
using UnityEngine;
using UnityEngine.Rendering;

namespace StereoCell.Editor
{
    /// <summary>
    /// Has specimens imported again whose bundle was built anew: a linked folder lies outside the project, so Unity does
    /// not see its changes. manifest.json names the hash of every other file, so its own hash stands for them all.
    /// Bundles are looked at when the editor starts, and whenever it comes to the front.
    /// </summary>
    [InitializeOnLoad]
    public static class BundleWatcher
    {
        public const string PipelineName = "StereoCell/pipeline";

        static BundleWatcher()
        {
            EditorApplication.delayCall += Look;
            EditorApplication.focusChanged += hasFocus =>
            {
                if (hasFocus) Look();
            };
        }

        /// <summary>The dependency of a specimen on its linked folder.</summary>
        public static string NameOf(string folder)
        {
            return "StereoCell/bundle/" + Path.GetFullPath(folder).Replace('\\', '/');
        }

        /// <summary>Note what linked bundles hold now. Unity then imports the specimens for which it has changed.</summary>
        public static void Look()
        {
            var pipeline = GraphicsSettings.currentRenderPipeline;
            AssetDatabase.RegisterCustomDependency(PipelineName, Hash128.Compute(pipeline == null ? "built-in" : pipeline.GetType().Name));
            foreach (var asset in Directory.GetFiles("Assets", "*." + SpecimenImporter.Ending, SearchOption.AllDirectories))
            {
                try
                {
                    var folder = BundleFiles.LinkedFolder(asset);
                    if (folder != null) Register(folder);
                }
                catch (IOException)
                {
                    // The import of this asset says what is wrong with it.
                }
            }
            AssetDatabase.Refresh();
        }

        public static void Register(string folder)
        {
            var manifest = Path.Combine(folder, "manifest.json");
            var text = File.Exists(manifest) ? File.ReadAllText(manifest) : "";
            AssetDatabase.RegisterCustomDependency(NameOf(folder), Hash128.Compute(text));
        }
    }
}
